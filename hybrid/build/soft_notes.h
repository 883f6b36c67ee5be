// SPDX-License-Identifier: GPL-3.0-or-later
// Notes on a soft object: how its spacing and the tool change the felt surface, and keys that its volume
// leaves without effect.
#pragma once

#include <span>
#include <vector>

#include "hybrid/build/build_world.h"

namespace hybrid {

// Slices thicker than this, by their pixels, move the felt surface by an eighth of a pixel or more.
inline constexpr double kThickSlices = 1.25;

// How voxels of this spacing are felt. A voxel is a ball of half the smallest spacing, and a ball that could
// slip between voxels is felt as the smallest one that cannot (voxel/object/soft_object.h).
struct FeltLattice {
  // Across the thickest axis the tool meets the surface this far inside of its volume; negative: outside.
  double inside_m = 0.0;
  double dip_m = 0.0;          // between two voxels along that axis the tool sinks this far further
  double felt_radius_m = 0.0;  // of the tool
};
[[nodiscard]] FeltLattice felt_lattice(const glm::dvec3& spacing_m, double tool_radius_m, double reach_m);

// Notes on spacing and tool, in figures.
void note_felt_surface(const Tool& tool, const std::string& name, const voxel::SoftObject& object,
                       std::vector<BuildNote>& notes);

// Labels that the description names and the volume does not have, and a distance to rigid objects within
// which no voxel lies (`near_rigid`: those within it). `volume`: as it is read, before overlap is removed.
void note_missing_labels(const SoftDescription& description, const voxel::LabelVolume& volume,
                         std::vector<BuildNote>& notes);
void note_missing_anchors(const SoftDescription& description, std::span<const std::size_t> near_rigid,
                          std::vector<BuildNote>& notes);

}  // namespace hybrid
