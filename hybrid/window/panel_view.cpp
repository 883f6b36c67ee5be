// SPDX-License-Identifier: GPL-3.0-or-later
// The panel's controls of the view: the past, directions, clip plane, slices, colours.
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "hybrid/base/number_text.h"
#include "hybrid/view/overlay.h"
#include "hybrid/window/controls.h"
#include "hybrid/window/panels.h"

namespace hybrid {

using namespace controls;

// Time runs to the right, and the present is at the right end.
void Panels::draw_past(const Pen& pen, const PanelFrame& frame, PanelResult& result) const {
  const SessionNotes& notes = frame.notes;
  const bool none = notes.kept_s.empty();
  label_beside(pen, "back to");
  auto at = static_cast<float>(-frame.state.back_s);
  const std::string words =
      frame.state.back_s > 0.0 ? with_decimals(frame.state.back_s, 1) + " s ago" : "now";
  begin_fixed(none || notes.real_device);
  const float oldest = none ? -1.0F : static_cast<float>(-notes.kept_s.front());
  if (slide("##back", at, oldest, 0.0F, words).changed)
    result.actions.push_back({.verb = ViewVerb::look_back, .numbers = {-static_cast<double>(at)}});
  tip(std::to_string(notes.kept_s.size()) + " states of the last minute, " +
      with_decimals(1e-6 * static_cast<double>(notes.kept_bytes), 0) + " MB");
  end_fixed();
  if (!(frame.state.back_s > 0.0)) return;
  const float half = 0.5F * (free_width() - gap());
  if (button("Go on from here (B)", half)) result.actions.push_back({.verb = ViewVerb::go_on});
  same_line();
  if (button("Back to now", half)) result.actions.push_back({.verb = ViewVerb::look_back, .numbers = {0.0}});
}

void Panels::draw_view(const Pen& pen, const DrawnScene& scene, const PanelFrame& frame,
                       PanelResult& result) {
  const ViewSettings& view = frame.state.view;
  const auto ask = [&](ViewVerb verb, std::vector<double> numbers = {}, std::string text = {}) {
    result.actions.push_back({.verb = verb, .numbers = std::move(numbers), .text = std::move(text)});
  };
  static constexpr std::array<const char*, 5> looks{"all", "contact", "x", "y", "z"};
  static constexpr std::array<const char*, 5> look_words{"all (F)", "contact (C)", "X", "Y", "Z"};
  const float narrow = 2.2F * pen.em;
  const float wide = 0.5F * (free_width() - 3.0F * narrow - 4.0F * gap());
  for (std::size_t n = 0; n < looks.size(); ++n) {
    if (n > 0) same_line();
    if (button(look_words[n], n < 2 ? wide : narrow)) ask(ViewVerb::look, {}, looks[n]);
  }
  if (std::exchange(bounds_of_, &scene) != &scene) {
    bounds_ = bounds_of(scene);
    box_ = soft_box(scene);
  }
  bool clip = view.clip.on;
  if (tick_box("clip", clip)) ask(ViewVerb::clip, {clip ? 1.0 : 0.0});
  for (int axis = 0; axis < 3; ++axis) {
    static constexpr std::array<const char*, 3> names{"x", "y", "z"};
    same_line();
    if (radio(names[static_cast<std::size_t>(axis)], view.clip.axis == axis))
      ask(ViewVerb::clip_axis, {static_cast<double>(axis)});
  }
  same_line();
  bool other = view.clip.other_side;
  if (tick_box("other side", other)) ask(ViewVerb::clip_side);
  if (clip) {
    auto share = static_cast<float>(view.clip.share);
    const std::string place = length_text(clip_place_m(view.clip, bounds_));
    label_beside(pen, "at");
    if (slide("##clip", share, 0.0F, 1.0F, place).changed)
      ask(ViewVerb::clip_place, {static_cast<double>(share)});
  }
  if (!box_.empty) draw_tissue_view(pen, view, result);
  bool inset = view.inset, dark = view.dark, wires = view.wires;
  if (tick_box("near view", inset)) ask(ViewVerb::inset, {inset ? 1.0 : 0.0});
  same_line();
  if (tick_box("dark", dark)) ask(ViewVerb::dark, {dark ? 1.0 : 0.0});
  same_line();
  bool trail = frame.state.trail, map = frame.state.map;
  if (tick_box("cells, patches (J)", map)) ask(ViewVerb::map, {map ? 1.0 : 0.0});
  tip("Near the tool: cells of the occupancy map with rigid surfaces (orange) and with tissue (green),\n"
      "and the boxes on which contacts with tissue are solved (blue)");
  if (tick_box("hand's path (D)", trail)) ask(ViewVerb::trail, {trail ? 1.0 : 0.0});
  same_line();
  if (tick_box("wireframe (U)", wires)) ask(ViewVerb::wires, {wires ? 1.0 : 0.0});
}

void Panels::draw_tissue_view(const Pen& pen, const ViewSettings& view, PanelResult& result) const {
  const auto ask = [&](ViewVerb verb, std::vector<double> numbers) {
    result.actions.push_back({.verb = verb, .numbers = std::move(numbers)});
  };
  label("slices");
  for (std::size_t axis = 0; axis < 3; ++axis) {
    static constexpr std::array<const char*, 3> names{"x##slice", "y##slice", "z##slice"};
    same_line();
    bool on = view.slices[axis].on;
    if (tick_box(names[axis], on))
      ask(ViewVerb::slice, {static_cast<double>(axis), on ? view.slices[axis].share : -1.0});
  }
  same_line();
  bool grey = view.grey;
  if (tick_box("grey values", grey)) ask(ViewVerb::slice_grey, {grey ? 1.0 : 0.0});
  tip("Slices show the scan that the tissue was made from, where the scene names one");
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!view.slices[axis].on) continue;
    static constexpr std::array<const char*, 3> names{"slice x", "slice y", "slice z"};
    static constexpr std::array<const char*, 3> ids{"##slice x", "##slice y", "##slice z"};
    auto share = static_cast<float>(view.slices[axis].share);
    label_beside(pen, names[axis]);
    const std::string place = length_text(box_.place_m(axis, view.slices[axis].share));
    if (slide(ids[axis], share, 0.0F, 1.0F, place).changed)
      ask(ViewVerb::slice, {static_cast<double>(axis), static_cast<double>(share)});
  }
  label_beside(pen, "tissue shows");
  const std::vector<std::string> colours(kTissueColours.begin(), kTissueColours.end());
  if (const auto taken = choose("##colour", colours[static_cast<std::size_t>(view.colour)], colours))
    ask(ViewVerb::colour, {static_cast<double>(*taken)});
}

}  // namespace hybrid
