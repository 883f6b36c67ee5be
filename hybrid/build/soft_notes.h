// SPDX-License-Identifier: GPL-3.0-or-later
// Notes on a soft object: how its spacing and the tool change the felt surface, and which of its keys have no
// effect with its volume.
#pragma once

#include <span>
#include <vector>

#include "hybrid/build/build_world.h"

namespace hybrid {

// Slices thicker than this (unit: pixel size) move the felt surface by an eighth of a pixel or more.
inline constexpr double kThickSlices = 1.25;

// How voxels of this spacing are felt. A voxel is felt as a ball whose radius is half the smallest spacing. A
// tool that could slip between voxels is felt as the smallest ball that cannot (voxel/object/soft_object.h).
struct FeltLattice {
  // Along the axis with the largest spacing, the felt surface lies this far inside the drawn one; negative:
  // outside.
  double inside_m = 0.0;
  double dip_m = 0.0;          // how much deeper the tool sinks between two voxels along that axis
  double felt_radius_m = 0.0;  // radius of the tool as it is felt
};
[[nodiscard]] FeltLattice felt_lattice(const glm::dvec3& spacing_m, double tool_radius_m, double reach_m);

// Adds notes on how spacing and tool change the felt surface, with figures.
void note_felt_surface(const Tool& tool, const std::string& name, const voxel::SoftObject& object,
                       std::vector<BuildNote>& notes);

// note_missing_labels() reports labels that the description names and the volume does not have. `volume`: as
// read, before overlap is removed. note_missing_anchors() reports a distance `rigid_within` within which no
// voxel lies. `near_rigid`: the voxels within that distance.
void note_missing_labels(const SoftDescription& description, const voxel::LabelVolume& volume,
                         std::vector<BuildNote>& notes);
void note_missing_anchors(const SoftDescription& description, std::span<const std::size_t> near_rigid,
                          std::vector<BuildNote>& notes);

// Notes whether the object's contacts are kept on nested patches. `why_not`: the reason if they are not,
// otherwise empty.
void note_patches(const SoftDescription& description, const voxel::SoftObject& object,
                  const std::string& why_not, std::vector<BuildNote>& notes);

}  // namespace hybrid
