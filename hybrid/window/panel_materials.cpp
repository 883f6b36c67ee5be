// SPDX-License-Identifier: GPL-3.0-or-later
// The panel's controls of an object's materials: which are drawn, and how much is seen through them.
#include <string>
#include <vector>

#include "hybrid/view/palette.h"
#include "hybrid/window/controls.h"
#include "hybrid/window/panels.h"

namespace hybrid {

using namespace controls;

void Panels::draw_materials(const Pen& pen, const DrawnScene& scene, const PanelFrame& frame,
                            PanelResult& result) const {
  const std::uint32_t object = frame.state.selected;
  const std::vector<std::string>& names = scene.objects[object].inside.materials;
  if (names.size() < 2) return;
  const std::vector<glm::vec3> colours = palette::of_inside(scene, object);
  for (std::size_t m = 0; m < names.size(); ++m) {
    const Look look = frame.state.view.material_look_of(object, names[m]);
    bool visible = look.visible;
    tick_beside(pen, names[m], colours[m], visible);
    if (visible != look.visible)
      result.actions.push_back(
          {.verb = ViewVerb::show, .numbers = {visible ? 1.0 : 0.0}, .text = names[m], .object = object});
    float opacity = 100.0F * look.opacity;
    const std::string id = "##opacity " + names[m];
    if (slide(id.c_str(), opacity, 0.0F, 100.0F, "%.0f %%").changed)
      result.actions.push_back({.verb = ViewVerb::opacity,
                                .numbers = {0.01 * static_cast<double>(opacity)},
                                .text = names[m],
                                .object = object});
  }
}

}  // namespace hybrid
