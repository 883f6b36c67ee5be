// SPDX-License-Identifier: GPL-3.0-or-later
// The soft stage of the tick: which voxels are near the tool, and what they answer when it moves.
#pragma once

#include "hybrid/world/world_state.h"

namespace hybrid {

// Hands each soft object its surface voxels within `range` of the tool at `point` (scene frame) beyond its
// reach. True when any is near. Where they are more than fit, `range` becomes smaller: the tool may not go
// further than that in this tick.
bool find_touched_voxels(const World& world, WorldState& state, const glm::dvec3& point,
                         double& range) noexcept;

// Tool moved to `point` by `delta`: pressed voxels follow, the rest is pushed out, the neighbourhood relaxes
// by `sweeps`, and state.reactions are what each object then answers (scene frame).
void press_tissue(const World& world, WorldState& state, const glm::dvec3& point, const glm::dvec3& delta,
                  int sweeps) noexcept;

// Half-spaces of voxels that could not leave the way of a tool at `point`, appended to `out` as far as its
// capacity goes; `fast`: only of those that cannot, until what holds them moves. Returns how many.
std::size_t tool_bounds(const World& world, WorldState& state, const glm::dvec3& point, bool fast,
                        std::vector<polygon::ContactPlane>& out) noexcept;

// The tool in an object's volume frame.
voxel::ToolInBody tool_in_body(const World& world, const SoftBody& body, const glm::dvec3& point) noexcept;

// Largest distance from the tool's centre at which it can touch a voxel of any soft object (unit: meter).
double soft_reach(const World& world, const WorldState& state) noexcept;

// Is something pressed whose contact is on a composite grid? The map has such an object as it is at rest.
[[nodiscard]] bool contact_on_patches(const WorldState& state) noexcept;
// Objects on such a grid that are not pressed make ready for a tool at `point` (scene frame).
void prepare_patches(const World& world, WorldState& state, const glm::dvec3& point) noexcept;
// Tells the map where surface voxels are now: those near the tool, those the chain moved, and a slice of the
// rest.
void refresh_map(const World& world, WorldState& state) noexcept;

// Where surface voxels are looked at in turns, and it is that of `number`: has the displacement of one whose
// turn comes soon fetched into the cache. It stands in none, and to wait for it was half of what that took.
inline void fetch_surface_ahead(const voxel::SoftObject& object, std::uint32_t number) noexcept {
  constexpr std::uint32_t kAhead = 16;
  const auto surface = object.lattice().surface();
  if (number + kAhead >= surface.size()) return;
  for (const auto& axis : object.state().u) __builtin_prefetch(axis.data() + surface[number + kAhead]);
}

}  // namespace hybrid
