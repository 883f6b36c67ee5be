// SPDX-License-Identifier: GPL-3.0-or-later
// Pose of a body.
#pragma once

#include <glm/gtc/quaternion.hpp>
#include <glm/vec3.hpp>

namespace hybrid {

struct Pose {  // body frame to scene frame
  glm::dvec3 position_m{0.0};
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};

  bool operator==(const Pose&) const = default;
};

}  // namespace hybrid
