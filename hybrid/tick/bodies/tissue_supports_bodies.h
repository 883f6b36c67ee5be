// SPDX-License-Identifier: GPL-3.0-or-later
// What tissue answers to a free rigid body: it is carried, and stopped, by the surface voxels that its
// half-spaces hold (bodies_press_tissue.h).
//
// Each of them is a contact of its own. Its force is the multiplier of its half-space: what its links would
// pull it into the body by. Its stiffness is that of all its links with the voxels around it still, which is
// more than tissue ever answers with within a tick: what the body pays for pressing a voxel is then no less
// than what the links store by it, and tissue that comes to rest afterwards only loses energy. A voxel that
// the body has not yet reached is a contact as well, from where they meet on: or a body that is thrown would
// press tissue in its first tick without paying for it.
//
// Where links at their limits, anchors or bone keep a voxel in the body's way, it is as good as rigid: it was
// blocked, and a tick ended with it in the body. That ends a body's motion without throwing it back, and what
// is too deep then goes back.
#pragma once

#include "hybrid/world/world_state.h"

namespace hybrid {

// Of the spacing: a body that is deeper in tissue as a step or tick ends goes back.
inline constexpr double kTooDeep = 0.02;

// Of the spacing: a blocked voxel lets a body in by this, so that it is seen when it is blocked no more.
inline constexpr double kJammedProbe = 0.01;

// Of all soft objects, of which there is one (m).
[[nodiscard]] double least_spacing_m(const WorldState& state) noexcept;

// Appends to state.scratch.body_contacts what tissue presses free body `b` with, as far as there is room.
// Returns how many of them are links; after them come those that are as good as rigid.
std::size_t add_tissue_contacts(const World& world, WorldState& state, std::uint32_t b, double dt_s) noexcept;

// Free body `b`, at `pose` in this tick, is in tissue deeper than by `limit` (spacings): it goes back from
// there, and no longer goes in. False: it is not.
bool give_way_to_tissue(const World& world, WorldState& state, std::uint32_t b, const Pose& pose,
                        double limit, double dt_s) noexcept;

// Tissue under bodies on paths, where its links are at their limits, goes on towards its least energy.
void relax_under_paths(const World& world, WorldState& state) noexcept;

// As a tick ends, after all that moves tissue: so for every free body, and notes which voxels are blocked.
void push_bodies_out_of_tissue(const World& world, WorldState& state, double dt_s) noexcept;

}  // namespace hybrid
