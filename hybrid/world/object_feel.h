// SPDX-License-Identifier: GPL-3.0-or-later
// One object's part of the force on the hand.
#pragma once

#include <glm/vec3.hpp>

namespace hybrid {

struct ObjectFeel {
  bool contact = false;
  double force_N = 0.0;       // length of on_hand_N
  glm::dvec3 on_hand_N{0.0};  // scene frame; the sum over all objects is the felt force before its limits
};

}  // namespace hybrid
