// SPDX-License-Identifier: GPL-3.0-or-later
// Frictionless sliding of pressed voxels on the tool, as a part of relaxation.
//
// During a cycle, the tool's surface is replaced by its tangent plane at each pressed voxel. The voxel keeps
// its displacement along the normal and relaxes in the plane, on every level. If it were fixed on all axes,
// cycles would not reduce the error of the contact itself.
#pragma once

#include <glm/vec3.hpp>
#include <optional>

#include "voxel/lattice/displacement.h"
#include "voxel/lattice/level_stiffness.h"

namespace voxel {

// The functions below are for voxels with the role `pressed`. `load_N` is added to the force of their links.

// Tangential force on a voxel (N); nullopt if its links do not allow it to move that way.
[[nodiscard]] std::optional<glm::dvec3> sliding_force(LevelStiffness& couplings, const Displacement& state,
                                                      VoxelId v, const glm::dvec3& load_N) noexcept;
// Moves a voxel to its least energy in the tangent plane. Returns the largest component of the motion (m).
float slide(LevelStiffness& couplings, Displacement& state, VoxelId v, const glm::dvec3& load_N) noexcept;
// Moves a voxel by the tangential part of `way`, or not at all if its links do not allow that. Returns the
// largest component of the motion (m).
float slide_by(LevelStiffness& couplings, Displacement& state, VoxelId v, const glm::dvec3& way) noexcept;

}  // namespace voxel
