// SPDX-License-Identifier: GPL-3.0-or-later
// What its links ask of one voxel, and allow it.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>

#include "voxel/lattice/displacement.h"
#include "voxel/lattice/lattice.h"
#include "voxel/lattice/level_stiffness.h"

namespace voxel {

// `couplings` are those of level 0.

// Where voxel v would go if only its links pulled, and the interval its links allow it, per axis (unit:
// meter).
glm::dvec3 unconstrained_minimum(LevelStiffness& couplings, const Displacement& state, VoxelId v) noexcept;
std::array<float, 2> link_interval(const Lattice& lattice, const Displacement& state, VoxelId v,
                                   int axis) noexcept;
glm::dvec3 clamp_to_links(const Lattice& lattice, const Displacement& state, VoxelId v,
                          const glm::dvec3& wanted) noexcept;
// The value nearest to `wanted` in the interval. An empty interval can only be a rounding wide: `now` then.
float clamp_to(const std::array<float, 2>& interval, float wanted, float now) noexcept;
// Force of its links on voxel v (unit: newton); of a lattice's own springs slowly, for references.
glm::dvec3 link_force(LevelStiffness& couplings, const Displacement& state, VoxelId v) noexcept;
glm::dvec3 link_force(const Lattice& lattice, const Displacement& state, VoxelId v) noexcept;
// The same along one axis, in a third of the time.
double link_force(LevelStiffness& couplings, const Displacement& state, VoxelId v, int axis) noexcept;
// How far a force of 1 N on voxel v alone moves it, per axis (unit: m/N); 0 where it is anchored.
glm::dvec3 link_compliance(LevelStiffness& couplings, VoxelId v) noexcept;

// The three of them together, which take twice as long one by one: what a touched voxel is asked six times a
// tick.
struct VoxelLinks {
  glm::dvec3 minimum{0.0}, compliance{0.0};        // unconstrained_minimum(), link_compliance()
  std::array<std::array<float, 2>, 3> interval{};  // link_interval(), [axis]
};
VoxelLinks links_of(LevelStiffness& couplings, const Displacement& state, VoxelId v) noexcept;
// clamp_to_links()
glm::dvec3 clamp_to_links(const VoxelLinks& links, const glm::dvec3& wanted, const glm::dvec3& now) noexcept;

struct ObstacleView {
  std::span<const Obstacle> obstacles;  // by surface number; empty: none
  const Lattice* lattice = nullptr;     // whose surface numbers these are
  std::size_t moving = 0;               // how many of them are of bodies that move

  [[nodiscard]] const Obstacle& of(VoxelId v) const { return obstacles[lattice->surface_number(v)]; }
};

// How deep a voxel displaced by `u` is in its obstacle (m; negative: clear of it).
double depth_in_obstacle(const Obstacle& o, const glm::dvec3& u) noexcept;
// Is a voxel whose role is obstacle within `margin` of it, or in it (unit: meter)?
bool is_jammed(const ObstacleView& view, const Displacement& state, VoxelId v, double margin) noexcept;
// The way of a voxel that must go no deeper into its obstacle than it was: as far as that, however links
// clamped it (each axis is held by its own).
glm::dvec3 no_deeper(const Obstacle& o, const glm::dvec3& before, const glm::dvec3& after) noexcept;
// Takes a voxel whose role is obstacle where its links would have it, on this side of the obstacle. One that
// is in it comes out as far as its links allow, and no deeper.
void relax_obstacle(LevelStiffness& couplings, Displacement& state, const ObstacleView& view, VoxelId v,
                    const glm::dvec3& load_N) noexcept;

}  // namespace voxel
