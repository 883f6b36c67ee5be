// SPDX-License-Identifier: GPL-3.0-or-later
// The panel's controls for changes that need a new world: model, energy, spacing, Young's modulus. The effect
// of the last one.
#include <imgui.h>

#include <algorithm>
#include <limits>

#include "hybrid/base/number_text.h"
#include "hybrid/view/overlay.h"
#include "hybrid/window/panel_words.h"
#include "hybrid/window/panels.h"

namespace hybrid {
namespace {

using Key = SceneChange::Key;

constexpr float kUsualFactor = 10.0F;     // a slider goes from a tenth of the modulus to ten times that
constexpr int kFramesUntilBuilding = 30;  // longest wait for the first news of a scene that is built

// A list of two choices. Returns true if the user took the other one.
bool two_choices(const Pen& pen, const char* label, bool second, const char* first_words,
                 const char* second_words, bool enabled) {
  bool other = false;
  label_beside(pen, label);
  ImGui::BeginDisabled(!enabled);
  ImGui::PushID(label);
  if (ImGui::BeginCombo("##choice", second ? second_words : first_words)) {
    if (ImGui::Selectable(first_words, !second)) other = second;
    if (ImGui::Selectable(second_words, second)) other = !second;
    ImGui::EndCombo();
  }
  ImGui::PopID();
  ImGui::EndDisabled();
  return other;
}

std::string time_words(double us) {
  return us < 1000.0 ? with_digits(us, 3) + " µs" : with_digits(1e-3 * us, 3) + " ms";
}

std::string force_words(const std::optional<double>& force_N) {
  return force_N ? force_text(*force_N) : "not at rest";
}

// "1 234 567"
std::string grouped(std::size_t number) {
  std::string words = std::to_string(number);
  for (std::size_t at = words.size(); at > 3; at -= 3) words.insert(at - 3, " ");
  return words;
}

void right_aligned(const Pen& pen, const std::string& words) {
  ImGui::SetCursorPosX(ImGui::GetCursorPosX() +
                       std::max(0.0F, ImGui::GetContentRegionAvail().x - pen.width(words)));
  ImGui::TextUnformatted(words.c_str());
}

void effect_row(const Pen& pen, const char* what, const std::string& before, const std::string& after) {
  ImGui::TableNextRow();
  ImGui::TableNextColumn();
  ImGui::TextUnformatted(what);
  ImGui::TableNextColumn();
  right_aligned(pen, before);
  ImGui::TableNextColumn();
  right_aligned(pen, after);
}

// The verdict on the force at the place of the change.
std::string verdict_on(const ChangeEffect& effect) {
  if (!effect.difference_jnd) return {};
  if (*effect.before_N == 0.0 && *effect.after_N == 0.0)
    return "The tool touched nothing then. Change it in contact to compare forces.";
  const std::string jnd = with_digits(*effect.difference_jnd, 2) + " JND";
  return *effect.difference_jnd < 1.0 ? "The difference is " + jnd + ": no hand tells it."
                                      : "The difference is " + jnd + ": a hand tells it.";
}

}  // namespace

void Panels::draw_young(const Pen& pen, const MaterialChoice& material, PanelResult& result) {
  const auto in_scene = static_cast<float>(1e-3 * material.young_Pa);
  const bool asked = asked_young_ && asked_young_->material == material.name;
  float shown = asked ? asked_young_->young_kPa : in_scene;
  label_beside(pen, pen.fit("E, " + material.name, 8.6F * pen.em));
  ImGui::PushID(material.name.c_str());
  ImGui::SliderFloat("##young", &shown, in_scene / kUsualFactor, in_scene * kUsualFactor,
                     (number_format(shown) + " kPa").c_str(),
                     ImGuiSliderFlags_Logarithmic | ImGuiSliderFlags_AlwaysClamp);
  ImGui::PopID();
  if (ImGui::IsItemHovered() && !ImGui::IsItemActive()) {
    ImGui::SetTooltip("Young's modulus of \"%s\"%s%s%s", material.name.c_str(),
                      material.shared_with.empty() ? "" : ", also of: ", material.shared_with.c_str(),
                      "\nTakes effect when you let go");
  }
  if (ImGui::IsItemActive()) asked_young_ = AskedYoung{material.name, shown, kFramesUntilBuilding};
  if (ImGui::IsItemDeactivatedAfterEdit()) {
    result.actions.push_back(
        {.verb = ViewVerb::change, .change = {Key::young, material.name, glm::dvec3(1e3 * shown, 0.0, 0.0)}});
  }
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
  if (two_choices(pen, "felt", choices.as_rigid, "by its voxels", "as rigid", choices.other_model))
    ask(Key::model, choices.as_rigid ? 0.0 : 1.0);
  if (!choices.as_rigid) {
    if (two_choices(pen, "energy", choices.trilinear, "six-link", "trilinear", choices.other_energy))
      ask(Key::energy, choices.trilinear ? 0.0 : 1.0);
    label_beside(pen, "spacing");
    if (ImGui::BeginCombo("##spacing", choices.spacing_words.c_str())) {
      for (const SpacingChoice& other : choices.spacings) {
        if (ImGui::Selectable(other.words.c_str())) ask(Key::spacing, other.spacing_m);
      }
      ImGui::EndCombo();
    }
    for (const MaterialChoice& material : choices.materials) draw_young(pen, material, result);
  }
  if (!choices.note.empty()) {
    ImGui::PushTextWrapPos();
    ImGui::TextDisabled("%s", choices.note.c_str());
    ImGui::PopTextWrapPos();
  }
}

void Panels::draw_effect(const Pen& pen, const PanelFrame& frame) const {
  if (!frame.notes.building.empty()) {
    ImGui::PushTextWrapPos();
    ImGui::TextDisabled("%s", frame.notes.building.c_str());
    ImGui::PopTextWrapPos();
    return;
  }
  const ChangeEffect& effect = *frame.notes.effect;
  const std::optional<ChangeMark>& mark = frame.history.last_change();
  ImGui::PushTextWrapPos();
  ImGui::TextUnformatted(effect.words.c_str());
  ImGui::PopTextWrapPos();
  if (!ImGui::BeginTable("effect", 3)) return;
  ImGui::TableSetupColumn("what", ImGuiTableColumnFlags_WidthStretch);
  ImGui::TableSetupColumn("before", ImGuiTableColumnFlags_WidthFixed, pen.width("8 888 888 N"));
  ImGui::TableSetupColumn("after", ImGuiTableColumnFlags_WidthFixed, pen.width("8 888 888 N"));
  effect_row(pen, "", "before", "after");
  effect_row(pen, "force at that place", force_words(effect.before_N), force_words(effect.after_N));
  if (mark) {
    constexpr double ever = std::numeric_limits<double>::infinity();
    const TickTimes after = frame.history.times(mark->t_s, ever);
    effect_row(pen, "largest force, 5 s", force_text(mark->most_before_N),
               force_text(frame.history.most_N(ForceSeries::total, mark->t_s, ever)));
    effect_row(pen, "tick, median", time_words(mark->before.p50_us), time_words(after.p50_us));
    effect_row(pen, "tick, 99 %", time_words(mark->before.p99_us), time_words(after.p99_us));
  }
  effect_row(pen, "voxels", grouped(effect.voxels_before), grouped(effect.voxels_after));
  ImGui::EndTable();
  const std::string verdict = verdict_on(effect);
  if (verdict.empty()) return;
  ImGui::PushTextWrapPos();
  ImGui::TextUnformatted(verdict.c_str());
  ImGui::PopTextWrapPos();
}

}  // namespace hybrid
