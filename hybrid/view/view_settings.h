// SPDX-License-Identifier: GPL-3.0-or-later
// How a window shows its scene. Nothing in it changes what is felt.
#pragma once

#include <glm/vec4.hpp>
#include <optional>
#include <vector>

#include "hybrid/view/camera.h"

namespace hybrid {

struct ObjectLook {
  bool visible = true;
  float opacity = 1.0F;  // 0 to 1
};

// A plane across the scene, perpendicular to an axis. What lies beyond it along the axis is left out.
struct ClipPlane {
  bool on = false;
  int axis = 0;             // 0: x, 1: y, 2: z
  double share = 0.5;       // place between the scene's lowest and highest point along the axis, 0 to 1
  bool other_side = false;  // leaves out what lies before it instead
};

struct ViewSettings {
  std::vector<ObjectLook> looks;  // [object]; further objects have the default
  ClipPlane clip;
  bool dark = false;
  bool inset = true;  // a nearer view of the contact

  [[nodiscard]] ObjectLook look_of(std::size_t object) const {
    return object < looks.size() ? looks[object] : ObjectLook{};
  }
};

// Coefficients of the plane (relative to `origin_m`) whose positive side is drawn; empty: nothing is clipped.
[[nodiscard]] std::optional<glm::vec4> clip_equation(const ClipPlane& clip, const SceneBounds& bounds,
                                                     const glm::dvec3& origin_m);
// The plane's place on its axis (m).
[[nodiscard]] double clip_place_m(const ClipPlane& clip, const SceneBounds& bounds);

}  // namespace hybrid
