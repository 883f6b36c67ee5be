// SPDX-License-Identifier: GPL-3.0-or-later
// The panel's controls for the difference that a hand would feel between two models, over a surface.
#include <algorithm>
#include <array>
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

// Depths that a slider offers (unit: the tool's radius), and the first one.
constexpr float kLeastDepth = 0.05F, kMostDepth = 5.0F, kUsualDepth = 0.5F;
constexpr double kPoint_m = 1e-3;  // in place of the radius of a tool that is a point

// The tissue that is selected, or else the first one that is drawn by its voxels.
std::optional<std::uint32_t> compared_object(const DrawnScene& scene, std::uint32_t selected) {
  const auto fits = [&](std::uint32_t o) {
    return o < scene.objects.size() && scene.objects[o].soft && scene.objects[o].choices.tissue;
  };
  if (fits(selected)) return selected;
  for (std::uint32_t o = 0; o < scene.objects.size(); ++o) {
    if (fits(o)) return o;
  }
  return std::nullopt;
}

std::string percent(double share) {
  return with_decimals(100.0 * share, share > 0.0 && share < 0.1 ? 1 : 0) + " %";
}

void write_result(const Pen& pen, const FeltDifference& found) {
  if (found.pressed == 0) {
    write("The tool has come to no place yet.", true);
    return;
  }
  write("A hand tells them apart on " + percent(found.share_felt) + " of the surface that was reached.");
  const std::vector<std::array<std::string, 3>> rows{
      {"", "A", "B"}, {"where they differ most", force_text(found.most.a_N), force_text(found.most.b_N)}};
  write_rows(pen, "difference", rows);
  write("Most: " + with_digits(found.most.jnd, 2) + " JND. Places: " + std::to_string(found.pressed) +
            " reached, " + std::to_string(found.places - found.pressed) + " not; at most " +
            length_text(found.gap_m) + " to the next.",
        true);
}

}  // namespace

void Panels::draw_difference(const Pen& pen, const DrawnScene& scene, const Snapshot& snapshot,
                             const PanelFrame& frame, PanelResult& result) {
  const auto object = compared_object(scene, frame.state.selected);
  if (!object) {
    write("No tissue is felt by its voxels.", true);
    return;
  }
  const double radius_m = scene.tool_radius_m > 0.0 ? scene.tool_radius_m : kPoint_m;
  const auto radius_mm = static_cast<float>(1e3 * radius_m);
  if (chosen_.scene != &scene || chosen_.object != *object)
    chosen_ = {&scene, *object, 0, 1, chosen_.depth_mm > 0.0F ? chosen_.depth_mm : kUsualDepth * radius_mm};
  const std::vector<ModelOption> options = model_options(scene.objects[*object]);
  std::vector<std::string> words;
  for (const ModelOption& option : options) words.push_back(option.words);
  write("\"" + scene.objects[*object].name + "\", pressed everywhere in two models");
  for (const bool first : {true, false}) {
    std::size_t& choice = first ? chosen_.a : chosen_.b;
    choice = std::min(choice, options.size() - 1);
    label_beside(pen, first ? "A, the reference" : "B");
    if (const auto taken = choose(first ? "##model a" : "##model b", words[choice], words)) choice = *taken;
  }
  label_beside(pen, "pressed by");
  (void)slide("##depth", chosen_.depth_mm, kLeastDepth * radius_mm, kMostDepth * radius_mm,
              number_format(chosen_.depth_mm) + " mm", true);
  const bool goes_on = !frame.notes.comparing.empty();
  begin_fixed(chosen_.a == chosen_.b);
  if (button(goes_on ? "Begin anew##difference" : "Compare##difference", 0.5F * (free_width() - gap())))
    result.actions.push_back({.verb = ViewVerb::difference,
                              .comparison = {scene.objects[*object].name, options[chosen_.a].changes,
                                             options[chosen_.b].changes, 1e-3 * chosen_.depth_mm, 0}});
  tip("The surface gets the colour of the difference.\n1 JND is the least difference that a hand feels.");
  end_fixed();
  same_line();
  begin_fixed(!goes_on);
  if (button("Stop##difference", free_width())) result.actions.push_back({.verb = ViewVerb::difference});
  end_fixed();
  if (goes_on) write(frame.notes.comparing, true);
  if (snapshot.difference != nullptr && snapshot.difference->object == *object)
    write_result(pen, *snapshot.difference);
}

}  // namespace hybrid
