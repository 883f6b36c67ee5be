// SPDX-License-Identifier: GPL-3.0-or-later
// The contact stage of the tick. Proxy, rigid planes and tissue depend on one another, so they are solved in
// passes. One proxy minimises the coupling's energy plus that of the tissue, subject to the rigid planes. The
// hand feels the coupling alone, so that no force adds energy over a closed path.
#pragma once

#include <limits>

#include "hybrid/tick/proxy/proxy_sweep.h"
#include "hybrid/world/world_state.h"

namespace hybrid {

// Result of the broad phase around the proxy.
struct Neighbourhood {
  bool free = false;       // the proxy reached the device through empty space: nothing can be felt
  bool near_soft = false;  // a surface voxel is within `range_m` of the tool's reach
  double range_m = std::numeric_limits<double>::max();  // how far the proxy may go in this tick
};

// How far the proxy may go in one tick without jumping over a voxel; unbounded if nothing is soft (m).
[[nodiscard]] double contact_range_m(const World& world, const WorldState& state) noexcept;

// Moves the proxy to its minimum and presses tissue with it. Fills state.reactions and state.rigid_force_N.
Sweep settle_contact(const World& world, WorldState& state, const glm::dvec3& device,
                     const Neighbourhood& around) noexcept;

// If tissue cannot leave the tool's way (because of anchors, bone or its own chain), the tool moves instead.
// It moves to the nearest place outside the tissue's bounds, or else back to `before`, its place at the start
// of the tick.
void give_way(const World& world, WorldState& state, const glm::dvec3& before, Sweep& sweep) noexcept;

}  // namespace hybrid
