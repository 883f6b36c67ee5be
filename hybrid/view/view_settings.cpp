// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/view_settings.h"

#include <algorithm>

namespace hybrid {

double clip_place_m(const ClipPlane& clip, const SceneBounds& bounds) {
  return bounds.centre_m[clip.axis] + (2.0 * std::clamp(clip.share, 0.0, 1.0) - 1.0) * bounds.radius_m;
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
