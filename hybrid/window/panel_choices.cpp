// SPDX-License-Identifier: GPL-3.0-or-later
// The panel's controls for changes that need a new world: model, energy, spacing, elasticity and limits of
// materials, size of the tool. Also shows the effect of the last change.
#include <algorithm>
#include <array>
#include <limits>
#include <string>
#include <vector>

#include "hybrid/base/number_text.h"
#include "hybrid/view/overlay.h"
#include "hybrid/window/controls.h"
#include "hybrid/window/panel_words.h"
#include "hybrid/window/panels.h"

namespace hybrid {

using namespace controls;

namespace {

using Key = SceneChange::Key;

constexpr double kLeastShown_jnd = 0.01;  // smaller differences are those of the equilibrium's tolerance
constexpr double kUsualFactor = 10.0;     // sliders go from a tenth of the scene's value to ten times that
constexpr double kLogarithmic = 50.0;     // a slider whose ends have a larger ratio is logarithmic
constexpr double kMostPoisson = 0.49;     // tissue above it is as good as incompressible
// Ends of the sliders of limits (unit: the rest length of a link). A scene's own value may lie beyond them.
constexpr double kUsualShortest = 0.05, kUsualLongest = 3.0, kUsualSlip = 2.0;

// A list of two choices. Returns true if the user took the other one.
bool took_other(const Pen& pen, const char* label, const char* id, bool second,
                const std::array<std::string, 2>& words, bool enabled) {
  label_beside(pen, label);
  begin_fixed(!enabled);
  const auto taken = choose(id, words[second ? 1 : 0], words);
  end_fixed();
  return taken && (*taken == 1) != second;
}

std::string force_words(double force_N) {
  return force_N > 0.0 ? force_text(force_N) : "none";
}

// "1 234 567"
std::string grouped(std::size_t number) {
  std::string words = std::to_string(number);
  for (std::size_t at = words.size(); at > 3; at -= 3) words.insert(at - 3, " ");
  return words;
}

// The verdict on the force at the place of the change.
std::string verdict_on(const std::optional<ComparedForces>& forces) {
  if (!forces) return "The forces at that place are being compared.";
  if (forces->before_N == 0.0 && forces->after_N == 0.0)
    return "The tool touched nothing then. Change it in contact to compare forces.";
  if (forces->difference_jnd < kLeastShown_jnd) return "The force is the same.";
  const std::string jnd = (forces->at_rest ? "" : "about ") + with_digits(forces->difference_jnd, 2) + " JND";
  return forces->difference_jnd < 1.0 ? "The difference is " + jnd + ": no hand tells it."
                                      : "The difference is " + jnd + ": a hand tells it.";
}

}  // namespace

// A slider of a value whose change needs a new world. It takes effect when the user lets go.
void Panels::draw_built_value(const Pen& pen, const BuiltValue& value, PanelResult& result) {
  const auto in_scene = static_cast<float>(value.in_scene / value.unit_SI);
  const bool asked = asked_value_ && asked_value_->key == value.key && asked_value_->name == value.name;
  float shown = asked ? asked_value_->shown : in_scene;
  label_beside(pen, pen.fit(value.label, 8.6F * pen.em));
  const std::string id = "##" + value.label + value.name;
  const Slid slid =
      slide(id.c_str(), shown, static_cast<float>(value.low / value.unit_SI),
            static_cast<float>(value.high / value.unit_SI), number_format(shown) + value.unit_words,
            value.low > 0.0 && value.high > kLogarithmic * value.low);
  tip(value.tip + "\nTakes effect when you let go");
  if (slid.held) asked_value_ = AskedValue{value.key, value.name, shown, kFramesUntilBuilding};
  if (!slid.let_go) return;
  const double si = static_cast<double>(shown) * value.unit_SI;
  result.actions.push_back(
      {.verb = ViewVerb::change, .change = {value.key, value.name, glm::dvec3(si, 0.0, 0.0)}});
}

void Panels::forget_asked_value(const PanelFrame& frame) {
  if (asked_value_ && !frame.notes.building.empty()) asked_value_->frames_left = 1;
  if (asked_value_ && frame.notes.building.empty() && --asked_value_->frames_left < 0) asked_value_.reset();
}

void Panels::draw_tool_size(const Pen& pen, const DrawnScene& scene, const PanelFrame& frame,
                            PanelResult& result) {
  const ToolChoices& tool = scene.tool_choices;
  forget_asked_value(frame);
  begin_fixed(!tool.open);
  const double from = tool.radius_m > 0.0 ? tool.radius_m : scene.tool_radius_m;
  draw_built_value(pen,
                   {.key = Key::radius,
                    .label = "radius",
                    .tip = tool.radius_m > 0.0 ? "Radius of the tool" : "Radius of the tool, now a point",
                    .in_scene = tool.radius_m,
                    .low = tool.radius_m > 0.0 ? from / kUsualFactor : 0.0,
                    .high = from * kUsualFactor,
                    .unit_SI = 1e-3,
                    .unit_words = " mm"},
                   result);
  end_fixed();
  if (!tool.note.empty()) write("The radius is " + tool.note, true);
}

// Poisson's ratio and limits of one material, which the user chooses: there may be many materials.
void Panels::draw_limits(const Pen& pen, const std::vector<MaterialChoice>& materials, PanelResult& result) {
  if (materials.empty()) return;
  auto shown = std::ranges::find(materials, limits_of_, &MaterialChoice::name);
  if (shown == materials.end()) shown = materials.begin();
  if (materials.size() > 1) {
    std::vector<std::string> names;
    for (const MaterialChoice& material : materials) names.push_back(material.name);
    label_beside(pen, "limits of");
    if (const auto taken = choose("##limits of", shown->name, names)) limits_of_ = names[*taken];
  }
  const MaterialChoice& m = *shown;
  const auto row = [&](Key key, const char* label, const char* words, double in_scene, double low,
                       double high) {
    draw_built_value(pen,
                     {.key = key,
                      .name = m.name,
                      .label = label,
                      .tip = std::string(words) + " of \"" + m.name + "\"",
                      .in_scene = in_scene,
                      .low = std::min(low, in_scene),
                      .high = std::max(high, in_scene)},
                     result);
  };
  row(Key::poisson, "Poisson's ratio", "Poisson's ratio", m.poisson, 0.0, kMostPoisson);
  row(Key::shortest, "shortest link", "Least length of a link, as a share of its rest length,", m.shortest,
      kUsualShortest, 1.0);
  row(Key::longest, "longest link", "Greatest length of a link, as a share of its rest length,", m.longest,
      1.0, kUsualLongest);
  row(Key::shear, "slip of a link", "Greatest slip across a link, as a share of its rest length,", m.shear,
      0.0, kUsualSlip);
}

void Panels::draw_choices(const Pen& pen, const DrawnScene& scene, const PanelFrame& frame,
                          PanelResult& result) {
  const DrawnObject& object = scene.objects[frame.state.selected];
  const ObjectChoices& choices = object.choices;
  const auto ask = [&](Key key, double value) {
    result.actions.push_back(
        {.verb = ViewVerb::change, .change = {key, object.name, glm::dvec3(value, 0.0, 0.0)}});
  };
  forget_asked_value(frame);
  begin_fixed(!choices.open);
  if (took_other(pen, "felt", "##felt", choices.as_rigid, {"by its voxels", "as rigid"}, choices.other_model))
    ask(Key::model, choices.as_rigid ? 0.0 : 1.0);
  if (!choices.as_rigid) {
    if (took_other(pen, "energy", "##energy", choices.trilinear, {"six-link", "trilinear"},
                   choices.other_energy))
      ask(Key::energy, choices.trilinear ? 0.0 : 1.0);
    label_beside(pen, "spacing");
    std::vector<std::string> words;
    for (const SpacingChoice& other : choices.spacings) words.push_back(other.words);
    if (const auto taken = choose("##spacing", choices.spacing_words, words))
      ask(Key::spacing, choices.spacings[*taken].spacing_m);
    for (const MaterialChoice& m : choices.materials) {
      draw_built_value(pen,
                       {.key = Key::young,
                        .name = m.name,
                        .label = "E, " + m.name,
                        .tip = "Young's modulus of \"" + m.name + "\"" +
                               (m.shared_with.empty() ? "" : ", also of: " + m.shared_with),
                        .in_scene = m.young_Pa,
                        .low = m.young_Pa / kUsualFactor,
                        .high = m.young_Pa * kUsualFactor,
                        .unit_SI = 1e3,
                        .unit_words = " kPa"},
                       result);
    }
    draw_limits(pen, choices.materials, result);
  }
  end_fixed();
  if (!choices.note.empty()) write(choices.note, true);
}

void Panels::draw_effect(const Pen& pen, const PanelFrame& frame) const {
  if (!frame.notes.building.empty()) {
    write(frame.notes.building, true);
    return;
  }
  const ChangeEffect& effect = *frame.notes.effect;
  write(effect.words);
  std::vector<std::array<std::string, 3>> rows{
      {"", "before", "after"},
      {"force at that place", effect.forces ? force_words(effect.forces->before_N) : "-",
       effect.forces ? force_words(effect.forces->after_N) : "-"}};
  if (const std::optional<ChangeMark>& mark = frame.history.last_change()) {
    constexpr double ever = std::numeric_limits<double>::infinity();
    const TickTimes after = frame.history.times(mark->t_s, ever);
    rows.push_back({"largest force, 5 s", force_text(mark->most_before_N),
                    force_text(frame.history.most_N(ForceSeries::total, mark->t_s, ever))});
    const auto of = [](const TickTimes& times, double us) {
      return times.ticks > 0 ? tick_time_text(us) : std::string("no tick");
    };
    rows.push_back({"tick, median", of(mark->before, mark->before.p50_us), of(after, after.p50_us)});
    rows.push_back({"tick, 99 %", of(mark->before, mark->before.p99_us), of(after, after.p99_us)});
  }
  rows.push_back({"voxels", grouped(effect.voxels_before), grouped(effect.voxels_after)});
  write_rows(pen, "effect", rows);
  write(verdict_on(effect.forces));
}

}  // namespace hybrid
