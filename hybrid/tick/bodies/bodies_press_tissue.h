// SPDX-License-Identifier: GPL-3.0-or-later
// Tissue leaves the way of rigid bodies that move, and comes back when they leave. What it answers to those
// that are free stands in tissue_supports_bodies.h.
//
// A surface voxel near such a body has its half-space, as one near bone has: outside of the plane through the
// body's nearest point. It is made anew in every tick in which either moved. What it then lies in, it leaves
// along the normal, all voxels in one wave of the chain, and relaxation does the rest. A voxel has one
// half-space: of body and bone that which it is nearer to, and where it is in both, the bone's.
//
// Which voxels those are: the map says which are in the body's box. Of each it is known how far it was when
// it was last looked at, and it is looked at again when body and voxel have moved so far in sum that it may
// be near: so nearly all exact queries are of voxels that are near.
#pragma once

#include "hybrid/world/world_state.h"

namespace hybrid {

// On load, after find_obstacles(): how far from bodies that press tissue its surface voxels are.
void watch_bodies(const World& world, WorldState& state);

// In the tick, after the bodies moved by dt_s and before the tool looks for its place. Those that moved by
// more than half a spacing come in steps of that: an edge that went further in one would push voxels beside
// one another different ways.
void press_bodies_into_tissue(const World& world, WorldState& state, double dt_s) noexcept;

// Body b was moved since: the voxels beside it are looked at again.
void look_again(const World& world, WorldState& state, std::uint32_t b) noexcept;

// At its end: sets a fault where tissue could not leave a body's way.
void flag_squeezed_bodies(const World& world, WorldState& state) noexcept;

// What fixed surfaces ask of surface voxel s of a soft object. Where no body presses tissue, that is its
// obstacle; else its obstacle is that, or what the nearest body asks.
[[nodiscard]] const voxel::Obstacle& standing_obstacle(const WorldState& state, std::size_t soft,
                                                       std::size_t s) noexcept;
void set_standing_obstacle(WorldState& state, std::size_t soft, std::size_t s,
                           const voxel::Obstacle& obstacle) noexcept;

}  // namespace hybrid
