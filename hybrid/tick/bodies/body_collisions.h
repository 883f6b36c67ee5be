// SPDX-License-Identifier: GPL-3.0-or-later
// Free bodies and everything rigid: they are stopped, carried and rubbed by one another, by what stands and
// by what is on a path, and pass through nothing, at any speed.
//
// Surfaces are kept apart at points (contact_points.h), of either object against the exact surface of the
// other, by a skin of 1e-4 of the smaller one. All contacts and bodies are one convex problem a tick
// (free_body.h). It is solved, the way of each point that came near is followed in the frame of the other
// surface in steps that jump over nothing (conservative advancement, Mirtich 1996, with the distance itself),
// where one ends inside its half-space becomes a contact, and so on until all ways are free. A body whose way
// is not free after that stands still for the tick.
//
// Nothing bounces. Friction is Coulomb's, with the mean (geometric) of both dynamic coefficients.
#pragma once

#include "hybrid/world/world_state.h"

namespace hybrid {

// On load: which pairs may touch, and room for them. Objects have their points (RigidObject::points).
void prepare_collisions(const World& world, WorldState& state);

// After that: what every point sees.
void watch_collisions(const World& world, WorldState& state);

// How deep the two are in one another, as their points see it (m); negative: so far apart.
[[nodiscard]] double overlap_m(const BodyPair& pair) noexcept;

// In the tick, when objects on paths were moved and before free ones are: takes state.stepped[i], as it is
// now, to where it is after dt_s, under state.scratch.body_contacts (the index in state.stepped as `body`)
// and what it collides with, which is appended there.
void step_past_rigid(const World& world, WorldState& state, double dt_s) noexcept;

// Appends to state.scratch.body_contacts, as body 0, what keeps free body `b` from going further into
// anything rigid.
void add_collision_stops(const World& world, WorldState& state, std::uint32_t b, double stiffness) noexcept;

}  // namespace hybrid
