// SPDX-License-Identifier: GPL-3.0-or-later
// Rigid surfaces stop tissue. Each surface voxel near a rigid surface has an obstacle: a half-space that it
// may not leave.
#pragma once

#include "hybrid/world/world_state.h"

namespace hybrid {

// A rigid surface within this distance of a surface voxel becomes its obstacle (spacings).
inline constexpr double kObstacleRange = 4.0;

// A voxel nearer to its half-space than this lies on it (spacings).
inline constexpr float kLiesOn = 1e-3F;

// The point of standing rigid surfaces that is nearest to `point` (scene frame), within `range` (m).
struct NearestRigid {
  glm::dvec3 normal{0.0};  // away from the surface, scene frame, unit
  double distance = 0.0;   // negative: within the solid
  std::uint32_t object = 0;
  bool found = false;
};
NearestRigid nearest_rigid(const World& world, const WorldState& state, const glm::dvec3& point,
                           double range) noexcept;

// On load: gives every surface voxel near a rigid surface its obstacle. Nothing presses at rest: a voxel that
// already overlaps keeps its depth. Returns how many voxels have an obstacle.
std::size_t find_obstacles(const World& world, WorldState& state, std::size_t soft);

// In the tick: queries rigid surfaces again for voxels that moved, a bounded number per tick. Voxels that may
// soonest meet an unknown surface come first. Candidates are the voxels that the tool touches, the rows that
// waves moved, and a slice of all surface voxels.
void refresh_obstacles(const World& world, WorldState& state) noexcept;
// In the tick: queries rigid surfaces again for rows that an asynchronous result moved, possibly far. A voxel
// inside a surface unknown to it leaves that surface at once.
void refresh_obstacles_of_arrived_rows(const World& world, WorldState& state) noexcept;

}  // namespace hybrid
