// SPDX-License-Identifier: GPL-3.0-or-later
// Forces of tissue on free rigid bodies. A body is carried and stopped by the surface voxels that have its
// half-spaces (bodies_press_tissue.h).
//
// Each such voxel is a contact of its own. Its force is the multiplier of the half-space: the force with
// which its links would pull the voxel into the body. Its stiffness is that of all its links with the
// neighbouring voxels fixed, which bounds the response of tissue within a tick. When the body presses a
// voxel, it therefore loses at least the energy that the links store. Relaxation afterwards only reduces the
// energy of tissue. A voxel that the body has not reached yet is a contact that begins where the two meet.
// Otherwise a thrown body would press tissue in its first tick without losing energy.
//
// A voxel is jammed if links at their limits, anchors or bone keep it in the body's way, so that a tick ends
// with the voxel in the body. Jammed voxels are as good as rigid: they end the body's motion without throwing
// it back, and a body that is too deep is moved back.
#pragma once

#include "hybrid/world/world_state.h"

namespace hybrid {

// Spacings: a body that is deeper in tissue at the end of a step or tick is moved back.
inline constexpr double kTooDeep = 0.02;

// Depth in spacings by which a body may overlap a jammed voxel. Some overlap must remain, because a smaller
// overlap shows that the voxel can leave again.
inline constexpr double kJammedProbe = 0.01;

// The smallest spacing of all soft objects (m); there must be one.
[[nodiscard]] double smallest_spacing_m(const WorldState& state) noexcept;

// Appends the contacts of tissue with free body `b` to state.scratch.body_contacts, while there is room.
// Returns how many of them are tissue links; contacts that are as good as rigid follow them.
std::size_t add_tissue_contacts(const World& world, WorldState& state, std::uint32_t b, double dt_s) noexcept;

// Is free body `b`, at `pose` within this tick, deeper in tissue than `limit` (spacings)? If so, moves it
// back, ends its motion into the tissue and returns true.
bool give_way_to_tissue(const World& world, WorldState& state, std::uint32_t b, const Pose& pose,
                        double limit, double dt_s) noexcept;

// Relaxes tissue under bodies on paths towards its least energy, where links are at their limits.
void relax_under_paths(const World& world, WorldState& state) noexcept;

// At the end of a tick, after all that moves tissue: moves back every free body that is too deep, and notes
// which voxels are jammed.
void push_bodies_out_of_tissue(const World& world, WorldState& state, double dt_s) noexcept;

}  // namespace hybrid
