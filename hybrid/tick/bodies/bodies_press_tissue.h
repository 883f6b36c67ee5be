// SPDX-License-Identifier: GPL-3.0-or-later
// Tissue leaves the way of rigid bodies that move, and returns when they leave. For the forces on free bodies
// see tissue_supports_bodies.h.
//
// A surface voxel near such a body has a half-space as its obstacle, as a voxel near bone has. The half-space
// is the outside of the plane through the body's nearest point. It is made anew in every tick in which voxel
// or body moved. Voxels inside the body leave along the normal. One wave of the chain moves all of them, and
// relaxation does the rest. A voxel has one half-space: that of the nearer of body and bone, or that of the
// bone if the voxel is inside both.
//
// The map lists the voxels in the body's box. A query of a voxel's distance also gives the sum of the motions
// of body and voxel before which the voxel cannot be near. Until then the voxel is not queried again. So
// nearly all exact queries are for voxels that are near.
#pragma once

#include "hybrid/world/world_state.h"

namespace hybrid {

// On load, after find_obstacles(): queries the distance of all surface voxels to bodies that press tissue.
void query_bodies(const World& world, WorldState& state);

// In the tick, after the bodies moved by dt_s and before the proxy moves. Motions of more than half a spacing
// are divided into steps: an edge that moved further in one step would push neighbouring voxels in different
// directions.
void press_bodies_into_tissue(const World& world, WorldState& state, double dt_s) noexcept;

// Call after body b was moved: queries the voxels near it again.
void query_again(const World& world, WorldState& state, std::uint32_t b) noexcept;

// At the end of the tick: sets a fault if tissue could not leave a body's way.
void flag_squeezed_bodies(const World& world, WorldState& state) noexcept;

// The half-space that fixed surfaces give to surface voxel s of a soft object. The voxel's present obstacle
// is this half-space or, if a body presses tissue, possibly that of the nearest body.
[[nodiscard]] const voxel::Obstacle& standing_obstacle(const WorldState& state, std::size_t soft,
                                                       std::size_t s) noexcept;
void set_standing_obstacle(WorldState& state, std::size_t soft, std::size_t s,
                           const voxel::Obstacle& obstacle) noexcept;

}  // namespace hybrid
