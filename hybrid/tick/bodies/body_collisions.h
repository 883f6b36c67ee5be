// SPDX-License-Identifier: GPL-3.0-or-later
// Collisions of free bodies with everything rigid: with one another, with fixed objects and with objects on
// paths. Bodies stop, carry and rub each other, and never pass through one another, at any speed.
//
// Contacts are points of either object (contact_points.h) against the exact surface of the other. Surfaces
// are kept apart by a skin of 1e-4 of the smaller object. All contacts and bodies of a tick form one convex
// problem (free_body.h).
//
// After each solution every near point is followed in the frame of the other surface, by conservative
// advancement (Mirtich 1996) with the exact distance. A point that comes too near becomes a further contact,
// and the problem is solved again until all ways are free. A body whose way is still not free in the last
// round stands still for the tick.
//
// Nothing bounces. Friction is Coulomb's, with the geometric mean of both dynamic coefficients.
#pragma once

#include "hybrid/world/world_state.h"

namespace hybrid {

// On load: lists the pairs that may touch and allocates their buffers. Needs RigidObject::points.
void prepare_collisions(const World& world, WorldState& state);

// On load, after prepare_collisions(): queries the distance of every point.
void query_collisions(const World& world, WorldState& state);

// Deepest overlap of the two bodies at their points (m); negative: their distance.
[[nodiscard]] double overlap_m(const BodyPair& pair) noexcept;

// In the tick, after objects on paths moved and before free ones do. Takes every
// scratch.free_bodies.stepped[i] from its present state to its state after dt_s. The loads are
// state.scratch.body_contacts (`body` is the index in `stepped`), to which the collision contacts are
// appended.
void step_with_collisions(const World& world, WorldState& state, double dt_s) noexcept;

// Appends to state.scratch.body_contacts, as body 0, contacts that keep free body `b` from going further into
// anything rigid.
void add_collision_stops(const World& world, WorldState& state, std::uint32_t b, double stiffness) noexcept;

}  // namespace hybrid
