// SPDX-License-Identifier: GPL-3.0-or-later
// The proxy on surfaces that are felt as more than hard and smooth: friction, shading, damping, texture. What
// no object asks for costs one comparison.
#pragma once

#include "hybrid/tick/proxy/proxy_sweep.h"

namespace hybrid {

// The sweep from state.proxy_m, with what the touched objects feel like: shading turns the goal, friction
// keeps the proxy or lets it slide. `force_N` of the answer is all that the surfaces do to the proxy.
//
// Friction is judged where the proxy is, by what held it at the end of the last pass: the normal where the
// proxy would go without friction is, on a curved surface, another one. So the first pass of a contact is
// smooth. `first_pass`: of the tick; in the later ones a proxy that slid comes to rest on the dynamic cone,
// and still slides in the next tick.
Sweep sweep_with_feel(const World& world, WorldState& state, const glm::dvec3& target,
                      const glm::dmat3& metric, double travel, bool first_pass) noexcept;

// What damping and texture add to the coupling's force on the hand (N, scene frame), and to
// state.rigid_force_N. `device_m` is where the device is. Call once a tick, with or without contact.
glm::dvec3 added_force(const World& world, WorldState& state, const glm::dvec3& device_m,
                       double dt_s) noexcept;

}  // namespace hybrid
