// SPDX-License-Identifier: GPL-3.0-or-later
// Contact between two soft objects: surface voxels of the finer one are stopped by facets of the other one's
// surface.
#pragma once

#include "hybrid/world/world_state.h"

namespace hybrid {

// In the tick: finds voxels of different objects that meet (a slice of the surface each tick), solves all
// contacts, and drops those that parted.
void solve_soft_contacts(const World& world, WorldState& state) noexcept;

}  // namespace hybrid
