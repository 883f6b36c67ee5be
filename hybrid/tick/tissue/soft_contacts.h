// SPDX-License-Identifier: GPL-3.0-or-later
// Two soft objects stop one another: surface voxels of the finer one stand on facets of the other one's
// surface.
#pragma once

#include "hybrid/world/world_state.h"

namespace hybrid {

// In the tick: finds pairs of voxels of different objects that meet (a slice of the surface a tick), relaxes
// all pairs, and lets go of those that parted.
void solve_soft_contacts(const World& world, WorldState& state) noexcept;

}  // namespace hybrid
