// SPDX-License-Identifier: GPL-3.0-or-later
// The rigid stage of the tick: moves the proxy to its constrained minimum, never through a surface.
#pragma once

#include "hybrid/world/world_state.h"

namespace hybrid {

struct Sweep {
  glm::dvec3 point{0.0};                 // end of the sweep, scene frame; outside everything rigid
  bool arrived = true;                   // false: `travel`, or the bound on steps or work, ended it first
  glm::dvec3 force_N{0.0};               // Σ multiplier · normal at the end: force of the rigid surfaces
  std::uint32_t steps = 0, surveys = 0;  // their number
  std::uint32_t work = 0;                // elements listed and planes renewed, weighted by their cost
};

// Greatest work of one sweep (unit: elements listed). At this bound the sweep stops before it has arrived,
// outside everything rigid, and the next tick continues it. The last survey or step may exceed the bound by
// the work of one neighbourhood.
inline constexpr std::uint32_t kMostSweepWork = 8192;

// Moves at most `travel` from the feasible point `from` towards the minimum of (q − target)ᵀ A (q − target).
// The way stays outside everything rigid and climbs over nothing but nearly flat edges. It ends when
// first-order conditions hold, or at the bound on steps or work. Each step goes straight to the minimum over
// planes that separate nearby elements from the proxy (polygon::Neighbourhood). Only elements that stand in
// the way get such a plane. Fills state.rigid_force_N.
Sweep sweep_proxy(const World& world, WorldState& state, const glm::dvec3& from, const glm::dvec3& target,
                  const glm::dmat3& metric, double travel) noexcept;

// The same against one object alone (`but` = false), or against all but that one (`but` = true), to the point
// nearest to `target`. Does not change forces or active elements.
Sweep sweep_past(const World& world, WorldState& state, std::uint32_t object, bool but,
                 const glm::dvec3& from, const glm::dvec3& target) noexcept;

}  // namespace hybrid
