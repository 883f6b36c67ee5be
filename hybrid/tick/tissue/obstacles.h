// SPDX-License-Identifier: GPL-3.0-or-later
// Rigid surfaces stop tissue: each surface voxel near one has a half-space that it may not leave, its
// obstacle.
#pragma once

#include "hybrid/world/world_state.h"

namespace hybrid {

// How near a rigid surface must be to a surface voxel, in spacings, to become its obstacle.
inline constexpr double kObstacleRange = 4.0;

// On load: gives every surface voxel near a rigid surface the half-space it may not leave. At rest nothing
// presses: a voxel that already overlaps keeps the depth it has. Returns how many voxels have one.
std::size_t find_obstacles(const World& world, WorldState& state, std::size_t soft);

// In the tick: voxels that moved look again for rigid surfaces, so many a tick, those first that are nearest
// to meeting one they have not seen. Looked through are what the tool touches, the rows that waves moved, and
// a slice of all. (By turns, and each whenever it had moved a quarter of its spacing, voxels far from
// everything took the looks of those that arrived: tissue thrown at a plate at 1 m/s went in by its spacing.)
void refresh_obstacles(const World& world, WorldState& state) noexcept;
// The same where what was relaxed apart arrived in this tick, which may be far from where it was. What is in
// a surface that it did not know leaves it at once. (Left to the next result, a brain that came down on the
// skull was in it by a tenth of a cell.)
void refresh_obstacles_of_arrived_rows(const World& world, WorldState& state) noexcept;

}  // namespace hybrid
