// SPDX-License-Identifier: GPL-3.0-or-later
// The panel's controls of the selected object, or of the tool: values that are edited while it is felt,
// opacity, arrows.
#include <algorithm>
#include <string>

#include "hybrid/base/number_text.h"
#include "hybrid/window/controls.h"
#include "hybrid/window/panel_words.h"
#include "hybrid/window/panels.h"

namespace hybrid {

using namespace controls;

void Panels::draw_slider(const Pen& pen, std::size_t index, const EditableValue& value, double now,
                         PanelResult& result) {
  const double unit = si_of_unit(value.quantity);
  const std::string unit_words(unit_of(value.quantity));
  label_beside(pen, words_of_value(value.quantity, value.object == Edit::kTool));
  float shown = moved_ == index ? moved_to_ : static_cast<float>(now / unit);
  const std::string id = "##value " + std::to_string(index);
  const Slid slid =
      slide(id.c_str(), shown, static_cast<float>(value.usual.low / unit),
            static_cast<float>(value.usual.high / unit),
            number_format(shown) + (unit_words.empty() ? "" : " " + unit_words), value.logarithmic);
  if (now != value.in_scene) tip("in the scene: " + with_digits(value.in_scene / unit, 3) + " " + unit_words);
  if (slid.changed) {
    moved_to_ = shown;
    const double si = std::clamp(static_cast<double>(shown) * unit, value.range.low, value.range.high);
    result.actions.push_back(
        {.verb = ViewVerb::edit, .numbers = {si}, .object = value.object, .quantity = value.quantity});
  }
  if (slid.held) {
    moved_ = index;
    moved_to_ = shown;
  } else if (moved_ == index) {
    moved_ = static_cast<std::size_t>(-1);
  }
}

void Panels::draw_values(const Pen& pen, const DrawnScene& scene, const Snapshot& snapshot,
                         const PanelFrame& frame, PanelResult& result) {
  const std::uint32_t selected = frame.state.selected;
  const bool object = selected < scene.objects.size();
  bool any = false, edited = false;
  for (std::size_t n = 0; n < scene.editable.size() && n < snapshot.values.size(); ++n) {
    const EditableValue& value = scene.editable[n];
    if (value.object != selected) continue;
    draw_slider(pen, n, value, snapshot.values[n], result);
    any = true;
    edited = edited || snapshot.values[n] != value.in_scene;
  }
  const bool tissue = object && scene.objects[selected].choices.tissue;
  if (tissue) draw_choices(pen, scene, frame, result);
  if (!any && !tissue) write("Its values are fixed while it is felt.", true);
  if (selected == Edit::kTool) {
    draw_tool_size(pen, scene, frame, result);
    write("Select an object above to change its stiffness.", true);
  }
  if (object) {
    label_beside(pen, "opacity");
    float opacity = 100.0F * frame.state.view.look_of(selected).opacity;
    if (slide("##opacity", opacity, 0.0F, 100.0F, "%.0f %%").changed)
      result.actions.push_back(
          {.verb = ViewVerb::opacity, .numbers = {0.01 * static_cast<double>(opacity)}, .object = selected});
    draw_materials(pen, scene, frame, result);
    bool moves = frame.state.moves;
    begin_fixed(!scene.objects[selected].choices.open);
    if (tick_box("arrows to move it (O)", moves))
      result.actions.push_back({.verb = ViewVerb::arrows, .numbers = {moves ? 1.0 : 0.0}});
    end_fixed();
  }
  if (!any) return;
  begin_fixed(!edited);
  if (button("Values of the scene")) {
    for (const EditableValue& value : scene.editable) {
      if (value.object == selected)
        result.actions.push_back({.verb = ViewVerb::edit,
                                  .numbers = {value.in_scene},
                                  .object = value.object,
                                  .quantity = value.quantity});
    }
  }
  end_fixed();
}

}  // namespace hybrid
