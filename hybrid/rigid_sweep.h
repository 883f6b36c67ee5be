// SPDX-License-Identifier: GPL-3.0-or-later
// The rigid stage of the tick: moves the proxy, never through anything, to its constrained minimum.
#pragma once

#include "hybrid/world.h"

namespace hybrid {

struct Sweep {
  glm::dvec3 point{0.0};    // where the proxy ends, scene frame; outside everything rigid
  bool arrived = true;      // false: `travel` or the bound on steps ended it first
  glm::dvec3 force_N{0.0};  // Σ multiplier · normal at the end: what the rigid surfaces press
};

// From `from`, which is feasible, at most `travel` far towards the minimum of (q − target)ᵀ A (q − target)
// over what can be reached, in steps of at most the gather radius, until first-order conditions hold or the
// bound is met. Fills state.rigid_force_N.
Sweep sweep_proxy(const World& world, WorldState& state, const glm::dvec3& from, const glm::dvec3& target,
                  const glm::dmat3& metric, double travel) noexcept;

// Half-spaces of all rigid elements within `radius` of `point`, into state.planes. False when there are too
// many.
bool gather_planes(const World& world, WorldState& state, const glm::dvec3& point, double radius) noexcept;

}  // namespace hybrid
