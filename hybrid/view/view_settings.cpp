// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/view_settings.h"

#include <algorithm>
#include <glm/common.hpp>

#include "polygon/mesh/is_finite.h"

namespace hybrid {

Look ViewSettings::material_look_of(std::size_t object, std::string_view material) const {
  if (object >= material_looks.size()) return {};
  const auto at = material_looks[object].find(material);
  return at == material_looks[object].end() ? Look{} : at->second;
}

double clip_place_m(const ClipPlane& clip, const SceneBounds& bounds) {
  return bounds.centre_m[clip.axis] + (2.0 * std::clamp(clip.share, 0.0, 1.0) - 1.0) * bounds.radius_m;
}

SoftBox soft_box(const DrawnScene& scene) {
  SoftBox box;
  for (const DrawnObject& object : scene.objects) {
    if (!object.soft) continue;
    for (const glm::dvec3& v : object.surface.vertices) {
      if (!polygon::is_finite(v)) continue;
      box.low_m = box.empty ? v : glm::min(box.low_m, v);
      box.high_m = box.empty ? v : glm::max(box.high_m, v);
      box.empty = false;
    }
  }
  return box;
}

bool has_soft(const DrawnScene& scene) {
  return std::ranges::any_of(scene.objects, [](const DrawnObject& object) { return object.soft; });
}

std::optional<glm::vec4> clip_equation(const ClipPlane& clip, const SceneBounds& bounds,
                                       const glm::dvec3& origin_m) {
  if (!clip.on) return {};
  const double side = clip.other_side ? 1.0 : -1.0;
  glm::dvec4 plane(0.0);
  plane[clip.axis] = side;
  plane.w = -side * (clip_place_m(clip, bounds) - origin_m[clip.axis]);
  return glm::vec4(plane);
}

}  // namespace hybrid
