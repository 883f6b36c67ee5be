// SPDX-License-Identifier: GPL-3.0-or-later
// Per-voxel queries of links: minimum of energy, limits, force and compliance; and relaxation at an obstacle.
//
// `couplings` is the LevelStiffness of level 0 throughout. Nothing here allocates or throws.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>

#include "voxel/lattice/displacement.h"
#include "voxel/lattice/lattice.h"
#include "voxel/lattice/level_stiffness.h"

namespace voxel {

// unconstrained_minimum(): displacement of voxel v at the least energy, with its neighbours fixed (m).
// link_interval(): displacements of v on `axis` that the limits of its links allow (m). clamp_to_links(): the
// nearest displacement to `wanted` within these intervals.
glm::dvec3 unconstrained_minimum(LevelStiffness& couplings, const Displacement& state, VoxelId v) noexcept;
std::array<float, 2> link_interval(const Lattice& lattice, const Displacement& state, VoxelId v,
                                   int axis) noexcept;
glm::dvec3 clamp_to_links(const Lattice& lattice, const Displacement& state, VoxelId v,
                          const glm::dvec3& wanted) noexcept;
// The value nearest to `wanted` in the interval. An interval that rounding made empty gives `now`.
float clamp_to(const std::array<float, 2>& interval, float wanted, float now) noexcept;
// Force of its links, bricks and plastic offsets on voxel v (N). The version with `lattice` is slow and meant
// for references.
glm::dvec3 link_force(LevelStiffness& couplings, const Displacement& state, VoxelId v) noexcept;
glm::dvec3 link_force(const Lattice& lattice, const Displacement& state, VoxelId v) noexcept;
// Component of link_force() along one axis, which is cheaper.
double link_force(LevelStiffness& couplings, const Displacement& state, VoxelId v, int axis) noexcept;
// Motion of voxel v by a force of 1 N on it, with its neighbours fixed, per axis (m/N); 0 if v is anchored.
glm::dvec3 link_compliance(LevelStiffness& couplings, VoxelId v) noexcept;

// Minimum, compliance and interval in one pass, for touched voxels.
struct VoxelLinks {
  glm::dvec3 minimum{0.0}, compliance{0.0};        // unconstrained_minimum(), link_compliance()
  std::array<std::array<float, 2>, 3> interval{};  // link_interval(), [axis]
};
VoxelLinks links_of(LevelStiffness& couplings, const Displacement& state, VoxelId v) noexcept;
// Like clamp_to_links() above, but with the intervals of `links`; `now` is the present displacement.
glm::dvec3 clamp_to_links(const VoxelLinks& links, const glm::dvec3& wanted, const glm::dvec3& now) noexcept;

struct ObstacleView {
  std::span<const Obstacle> obstacles;  // by surface number; empty: none
  const Lattice* lattice = nullptr;     // the lattice that defines the surface numbers
  std::size_t moving = 0;               // number of obstacles that are moving bodies

  [[nodiscard]] const Obstacle& of(VoxelId v) const { return obstacles[lattice->surface_number(v)]; }
};

// Depth of a voxel displaced by `u` in its obstacle (m; negative: outside).
double depth_in_obstacle(const Obstacle& o, const glm::dvec3& u) noexcept;
// For a voxel with an obstacle role: is it inside its obstacle, or within `margin` of it (m)?
bool is_jammed(const ObstacleView& view, const Displacement& state, VoxelId v, double margin) noexcept;
// Shortens the motion `before` → `after` so that the voxel gets no deeper into its obstacle, or does not
// enter it. Needed after clamp_to_links(), which clamps each axis separately.
glm::dvec3 no_deeper(const Obstacle& o, const glm::dvec3& before, const glm::dvec3& after) noexcept;
// Moves a voxel with an obstacle role towards its least energy outside the obstacle. A voxel inside comes out
// as far as its links allow, and never gets deeper.
void relax_obstacle(LevelStiffness& couplings, Displacement& state, const ObstacleView& view, VoxelId v,
                    const glm::dvec3& load_N) noexcept;

}  // namespace voxel
