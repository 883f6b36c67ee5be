// SPDX-License-Identifier: GPL-3.0-or-later
// The panel's controls for changes that need a new world: model, energy, spacing, Young's modulus. Also shows
// the effect of the last change.
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
constexpr float kUsualFactor = 10.0F;     // a slider goes from a tenth of the modulus to ten times that

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

void Panels::draw_young(const Pen& pen, const MaterialChoice& material, PanelResult& result) {
  const auto in_scene = static_cast<float>(1e-3 * material.young_Pa);
  const bool asked = asked_young_ && asked_young_->material == material.name;
  float shown = asked ? asked_young_->young_kPa : in_scene;
  label_beside(pen, pen.fit("E, " + material.name, 8.6F * pen.em));
  const Slid slid = slide(("##young " + material.name).c_str(), shown, in_scene / kUsualFactor,
                          in_scene * kUsualFactor, number_format(shown) + " kPa", true);
  tip("Young's modulus of \"" + material.name + "\"" +
      (material.shared_with.empty() ? "" : ", also of: " + material.shared_with) +
      "\nTakes effect when you let go");
  if (slid.held) asked_young_ = AskedYoung{material.name, shown, kFramesUntilBuilding};
  if (!slid.let_go) return;
  result.actions.push_back(
      {.verb = ViewVerb::change, .change = {Key::young, material.name, glm::dvec3(1e3 * shown, 0.0, 0.0)}});
}

void Panels::draw_choices(const Pen& pen, const DrawnScene& scene, const PanelFrame& frame,
                          PanelResult& result) {
  const DrawnObject& object = scene.objects[frame.state.selected];
  const ObjectChoices& choices = object.choices;
  const auto ask = [&](Key key, double value) {
    result.actions.push_back(
        {.verb = ViewVerb::change, .change = {key, object.name, glm::dvec3(value, 0.0, 0.0)}});
  };
  if (asked_young_ && !frame.notes.building.empty()) asked_young_->frames_left = 1;
  if (asked_young_ && frame.notes.building.empty() && --asked_young_->frames_left < 0) asked_young_.reset();
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
    for (const MaterialChoice& material : choices.materials) draw_young(pen, material, result);
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
