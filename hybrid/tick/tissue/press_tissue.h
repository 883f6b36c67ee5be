// SPDX-License-Identifier: GPL-3.0-or-later
// The soft stage of the tick: finds the voxels near the tool, and moves them when it moves.
#pragma once

#include "hybrid/world/world_state.h"

namespace hybrid {

// Gives each soft object its surface voxels within reach plus `range` of a tool at `point` (scene frame).
// True if any is near. If more are near than fit, `range` becomes smaller: it bounds the tool's motion in
// this tick.
bool find_touched_voxels(const World& world, WorldState& state, const glm::dvec3& point,
                         double& range) noexcept;

// The tool moved to `point` by `delta`: pressed voxels follow, those inside are pushed out, and the
// neighbourhood relaxes by `sweeps` sweeps. Sets state.reactions to each object's reaction (scene frame).
void press_tissue(const World& world, WorldState& state, const glm::dvec3& point, const glm::dvec3& delta,
                  int sweeps) noexcept;

// Appends to `out`, up to its capacity, half-spaces of voxels that could not leave the way of a tool at
// `point`. `immovable_only`: only of voxels that are immovable until their surroundings move. Then appends
// half-spaces of facets that are within `facets_within` of the centre (unit: the tool's reach). Returns how
// many were appended.
std::size_t tool_bounds(const World& world, WorldState& state, const glm::dvec3& point, bool immovable_only,
                        double facets_within, std::vector<polygon::ContactPlane>& out) noexcept;

// The tool in an object's volume frame.
voxel::ToolInBody tool_in_body(const World& world, const SoftBody& body, const glm::dvec3& point) noexcept;

// Largest distance from the tool's centre at which it can touch a voxel of any soft object (m).
double soft_reach(const World& world, const WorldState& state) noexcept;

// Is there an object whose contact is on nested patches? The map holds such an object in its rest state.
[[nodiscard]] bool contact_on_patches(const WorldState& state) noexcept;
// For a tool at `point` (scene frame): prepares objects that use nested patches and are not pressed yet.
void prepare_patches(const World& world, WorldState& state, const glm::dvec3& point) noexcept;
// Updates surface voxels in the map: those near the tool or a body, and a slice of the rest.
void refresh_map(const World& world, WorldState& state) noexcept;

// For loops over surface voxels in turns: prefetches the displacement of a voxel whose turn comes soon.
// Otherwise half of the loop's time would be waiting for memory.
inline void prefetch_surface(const voxel::SoftObject& object, std::uint32_t number) noexcept {
  constexpr std::uint32_t kAhead = 16;  // voxels
  const auto surface = object.lattice().surface();
  if (number + kAhead >= surface.size()) return;
  for (const auto& axis : object.state().u) __builtin_prefetch(axis.data() + surface[number + kAhead]);
}

}  // namespace hybrid
