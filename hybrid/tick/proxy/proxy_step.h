// SPDX-License-Identifier: GPL-3.0-or-later
// What the tick does with a proxy among rigid objects besides sweeping it: through free space, at the start,
// and the rigid part of the tick as a whole.
#pragma once

#include "hybrid/tick/proxy/proxy_sweep.h"

namespace hybrid {

// True when the map says that nothing lies between the proxy and `goal`, nor within the tool's reach of
// `soft_reach_m` on the way; then the proxy is there.
bool advance_through_free_space(const World& world, WorldState& state, const glm::dvec3& goal,
                                double soft_reach_m) noexcept;

// Puts the proxy where the device is, or where it can be nearest to it outside everything rigid. False when
// there is no such place: the session must not start there.
bool start_proxy(const World& world, WorldState& state, const glm::dvec3& device_m) noexcept;

// Half-spaces of the rigid elements within `radius` of `point`, into state.scratch.planes: the nearest, when
// there are too many. Returns how far from `point` there are no others (m).
double gather_planes(const World& world, WorldState& state, const glm::dvec3& point, double radius) noexcept;

// The rigid part of the tick and nothing else: map, contact, proxy, coupling. What `bench rigid` times.
struct RigidStep {
  glm::dvec3 proxy_m{0.0}, force_N{0.0};  // scene frame; the force on the hand, before any limit
  bool free = false;                      // nothing was near
  bool arrived = true;                    // false: a bound on the steps ended it
  std::uint32_t steps = 0, surveys = 0;
};
RigidStep step_rigid(const World& world, WorldState& state, const glm::dvec3& device_m, double dt_s) noexcept;

}  // namespace hybrid
