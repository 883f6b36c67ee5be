// SPDX-License-Identifier: GPL-3.0-or-later
// Moves the proxy among rigid objects: to a place outside them when a session starts, through free space, and
// in the rigid part of a tick alone. The proxy is never inside a rigid object. proxy_sweep.h moves it in
// contact.
#pragma once

#include "hybrid/tick/proxy/proxy_sweep.h"

namespace hybrid {

// True if the map says that nothing lies between the proxy and `goal`, nor within `soft_reach_m` of the way.
// The proxy is then at `goal`.
bool advance_through_free_space(const World& world, WorldState& state, const glm::dvec3& goal,
                                double soft_reach_m) noexcept;

// Puts the proxy at the device, or at a nearby place outside everything rigid. False if none is found: a
// session must not start there.
bool start_proxy(const World& world, WorldState& state, const glm::dvec3& device_m) noexcept;

// Writes the half-spaces of rigid elements within `radius` of `point` to state.scratch.planes; if there are
// too many, only the nearest. Returns the distance from `point` up to which they are complete (m).
double gather_planes(const World& world, WorldState& state, const glm::dvec3& point, double radius) noexcept;

// The rigid part of the tick alone: map, contact, proxy, coupling. It has no friction, damping, texture or
// limits (feel_stage.h, tick.h). `bench rigid` times it.
struct RigidStep {
  glm::dvec3 proxy_m{0.0}, force_N{0.0};  // scene frame; the force on the hand, before any limit
  bool free = false;                      // nothing was near
  bool arrived = true;                    // false: a bound on the steps ended the sweep
  std::uint32_t steps = 0, surveys = 0;
};
RigidStep step_rigid(const World& world, WorldState& state, const glm::dvec3& device_m) noexcept;

}  // namespace hybrid
