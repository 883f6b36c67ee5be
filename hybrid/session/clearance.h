// SPDX-License-Identifier: GPL-3.0-or-later
// How near to one another the objects of a scene come, for plots: looked at between ticks, never in one.
#pragma once

#include <vector>

#include "hybrid/world/world_state.h"

namespace hybrid {

// Between the surfaces of voxels, each a ball of half its spacing, and what is nearest to one of them (m).
// Negative: how deep they overlap. Not a number: nothing is near.
struct Clearance {
  double rigid_m, soft_m;
};
Clearance clearance(const World& world, const WorldState& state) noexcept;

// Over time.
struct ClearanceCourse {
  std::vector<double> t_s, rigid_m, soft_m;
  double cell_m = 0.0;  // the smallest spacing in the scene
};

}  // namespace hybrid
