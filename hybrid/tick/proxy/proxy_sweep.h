// SPDX-License-Identifier: GPL-3.0-or-later
// The rigid stage of the tick: moves the proxy, never through anything, to its constrained minimum.
#pragma once

#include "hybrid/world/world_state.h"

namespace hybrid {

struct Sweep {
  glm::dvec3 point{0.0};                 // where the proxy ends, scene frame; outside everything rigid
  bool arrived = true;                   // false: `travel` or the bound on steps ended it first
  glm::dvec3 force_N{0.0};               // Σ multiplier · normal at the end: what the rigid surfaces press
  std::uint32_t steps = 0, surveys = 0;  // what it took
};

// From `from`, which is feasible, at most `travel` far towards the minimum of (q − target)ᵀ A (q − target)
// over what can be reached on a way that stays outside and climbs over nothing but nearly flat edges, until
// first-order conditions hold or the bound on steps is met. Each step goes straight to the minimum over the
// planes that separate the elements near from the proxy (polygon::Neighbourhood), made lazily: only those in
// the way. Fills state.rigid_force_N.
Sweep sweep_proxy(const World& world, WorldState& state, const glm::dvec3& from, const glm::dvec3& target,
                  const glm::dmat3& metric, double travel) noexcept;

// The same against one object alone (`but` = false), or against all but that one (`but` = true), to the point
// nearest to `target`. Nothing is said of forces, nor of what holds the proxy.
Sweep sweep_past(const World& world, WorldState& state, std::uint32_t object, bool but,
                 const glm::dvec3& from, const glm::dvec3& target) noexcept;

}  // namespace hybrid
