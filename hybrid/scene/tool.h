// SPDX-License-Identifier: GPL-3.0-or-later
// The shape and coupling of the tool.
#pragma once

#include <cstdint>

namespace hybrid {

struct Tool {
  enum class Shape : std::uint8_t { ball, punch } shape = Shape::ball;
  double radius_m = 2e-3;             // 0: a point, for rigid objects
  double stiffness_N_per_m = 1000.0;  // of the virtual coupling
};

}  // namespace hybrid
