// SPDX-License-Identifier: GPL-3.0-or-later
// Distances between the objects of a scene, for plots. They are measured between ticks, never within one.
#pragma once

#include <vector>

#include "hybrid/world/world_state.h"

namespace hybrid {

// Least distance between the surface voxels and any other surface (m). A surface voxel counts as a ball whose
// diameter is the spacing. Negative: depth of the overlap. NaN: nothing is near.
struct Clearance {
  double rigid_m, soft_m;
};
Clearance clearance(const World& world, const WorldState& state) noexcept;

// The clearance over the time of a session.
struct ClearanceCourse {
  std::vector<double> t_s, rigid_m, soft_m;
  double cell_m = 0.0;  // the smallest spacing in the scene
};

}  // namespace hybrid
