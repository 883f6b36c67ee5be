// SPDX-License-Identifier: GPL-3.0-or-later
// A first path through a composed scene. The tool comes from outside and presses the objects that it can
// reach one after another.
#pragma once

#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "hybrid/build/build_world.h"
#include "hybrid/compose/parts_from_labels.h"

namespace hybrid {

struct PathPoint {
  glm::dvec3 at_m{0.0};
  double hold_s = 0.0;
  std::string comment{};
};
struct Press {
  std::string what, where;  // for example "liver (label 5)" and "from the front"
};
// Something that the path does not press.
struct NotPressed {
  std::string what;
  bool hidden = false;  // true: other objects lie in front of it on every side; false: other objects are
                        // easier to reach
};
struct PressPath {
  std::vector<PathPoint> points{};
  std::vector<Press> presses{};
  double speed_m_per_s = 0.05;
  std::vector<NotPressed> not_pressed{};
};

// The reason, in words that follow "not pressed, ".
[[nodiscard]] constexpr const char* not_pressed_why(bool hidden) {
  return hidden ? "because others lie in front on every side" : "because others are easier to reach";
}

// Plans a path of presses. There is a height map for each axis and direction, dilated by the tool. It gives
// the first contact of a ball that comes along the axis. Each kind of bone, mesh and tissue is pressed once,
// from the direction that most of its surface faces. A target that others hide from all six directions is not
// pressed. At most eight rigid and eight soft targets are pressed. Between two presses the tool strokes over
// the surface. From one view to the next it moves round the scene's box. `built` has the objects of `parts`,
// in order.
PressPath plan_presses(const BuiltScene& built, const SceneParts& parts, double tool_radius_m);

}  // namespace hybrid
