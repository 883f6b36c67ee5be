// SPDX-License-Identifier: GPL-3.0-or-later
// A first path through a composed scene: the tool comes from outside and presses what it can reach, one thing
// after another.
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
  std::string what, where;  // "liver (label 5)", "from the front"
};
struct PressPath {
  std::vector<PathPoint> points{};
  std::vector<Press> presses{};
  double speed_m_per_s = 0.05;
  std::vector<std::string> hidden{};  // what lies where no press reaches it first
};

// Looks at the scene along each axis, both ways, as heights over a grid, each dilated by the tool: what a
// ball meets first that comes along the axis, and where. Each kind of bone, mesh and tissue is pressed once,
// from where most of it faces the tool. From press to press the tool strokes over what lies between, and it
// goes round the outside from view to view. `built` has the objects of `parts`, in order.
PressPath plan_presses(const BuiltScene& built, const SceneParts& parts, double tool_radius_m);

}  // namespace hybrid
