// SPDX-License-Identifier: GPL-3.0-or-later
// What the tool presses slides along it, without friction, and relaxes as it does.
//
// Between two looks at its contact the tool is its tangent plane at each pressed voxel: there the voxel stays
// along the normal, and moves along the plane with all that relaxes, on every level. (Held on all axes, and
// brought to its place on the tool by itself between cycles, a contact of 32 voxels kept 0.6 of its error in
// each, however well all else was at rest: that, and not the volume, was what a force took longest for.)
#pragma once

#include <glm/vec3.hpp>
#include <optional>

#include "voxel/lattice/displacement.h"
#include "voxel/lattice/level_stiffness.h"

namespace voxel {

// Of voxels whose role is pressed; `load_N`: what pulls them beside their links.

// What pulls a voxel along the tool's surface (N); nothing where its links keep it from going there.
[[nodiscard]] std::optional<glm::dvec3> sliding_force(LevelStiffness& couplings, const Displacement& state,
                                                      VoxelId v, const glm::dvec3& load_N) noexcept;
// Brings it to where its energy is least along the tool. Returns how far it went, on the axis on which it
// went furthest (m).
float slide(LevelStiffness& couplings, Displacement& state, VoxelId v, const glm::dvec3& load_N) noexcept;
// Takes it along by the part of `way` that is along the tool, or not at all where links do not allow it.
float slide_by(LevelStiffness& couplings, Displacement& state, VoxelId v, const glm::dvec3& way) noexcept;

}  // namespace voxel
