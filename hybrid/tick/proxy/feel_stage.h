// SPDX-License-Identifier: GPL-3.0-or-later
// The proxy on surfaces with friction, shading, damping or texture. An effect that no object in contact has
// costs one comparison.
#pragma once

#include "hybrid/tick/proxy/proxy_sweep.h"

namespace hybrid {

// The sweep from state.proxy_m with the feel of the touched objects: shading turns the goal, friction keeps
// the proxy or lets it slide. `force_N` of the result is the whole force of the surfaces on the proxy.
//
// Friction is judged at the proxy, with the contacts that held it at the end of the last pass. On a curved
// surface the normal at the frictionless goal differs. The first pass of a contact is therefore frictionless.
// `first_pass`: of the tick. In later passes a proxy that slid comes to rest on the dynamic cone, and still
// counts as sliding in the next tick.
Sweep sweep_with_feel(const World& world, WorldState& state, const glm::dvec3& target,
                      const glm::dmat3& metric, double travel, bool first_pass) noexcept;

// Updates the coupling for the touched objects, where objects have stiffnesses of their own, and scales the
// forces on the proxy to it. Call once a tick, with or without contact, after the proxy has moved.
void mix_stiffness(const World& world, WorldState& state, const glm::dvec3& device_m, double dt_s,
                   Sweep& sweep) noexcept;

// Damping and texture force, added to the coupling's force on the hand (N, scene frame) and to
// state.rigid_force_N. `device_m`: the device's position. Call once a tick, with or without contact.
glm::dvec3 added_force(const World& world, WorldState& state, const glm::dvec3& device_m,
                       double dt_s) noexcept;

}  // namespace hybrid
