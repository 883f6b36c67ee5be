// SPDX-License-Identifier: GPL-3.0-or-later
// Conversions between label volumes and meshes: a surface from labels, labels from a surface, and growing of
// labels.
#pragma once

#include <cstddef>
#include <span>

#include "polygon/mesh/mesh.h"
#include "voxel/volume/label_volume.h"

namespace hybrid {

// The intensities of a volume's voxels, and the range of those that are inside.
struct IntensityRange {
  std::span<const float> intensities;  // as many as labels
  double lower = 0.0, upper = 0.0;
};

// Surface of all voxels whose label is not 0, in the volume frame (m): closed, oriented outward, by surface
// nets (Gibson 1998). Boundary cells have one vertex per sheet, and quads are split into triangles. Then
// follow `smoothing` constrained smoothing passes, in which a vertex stays within its cell.
polygon::TriangleMesh surface_from_labels(const voxel::LabelVolume& volume, int smoothing);

// As surface_from_labels(), but a vertex starts where the intensity, linear between two voxel centres, passes
// an end of the range. So a scan's surface lies between its voxels. Where the labels differ from the range
// (pieces that were dropped, cavities that were filled), the vertex starts half way.
polygon::TriangleMesh surface_from_intensities(const voxel::LabelVolume& volume, const IntensityRange& range,
                                               int smoothing);

// Keeps the largest 6-connected piece; `fill_cavities` also labels (1) enclosed empty space.
void keep_largest_piece(voxel::LabelVolume& volume, bool fill_cavities);

// Adds label 1 within `distance_m` (Euclidean) of filled voxels; the lattice is enlarged as needed.
voxel::LabelVolume grow_labels(const voxel::LabelVolume& volume, double distance_m);

// Gives `label` to every voxel whose centre is inside a closed mesh, by parity along lattice rows. The
// volume's frame is the body's frame up to origin_m. Throws std::invalid_argument with the numbers: the mesh
// is not closed, the lattice is above max_voxels, or nothing is inside.
voxel::LabelVolume voxelise_mesh(const polygon::TriangleMesh& mesh, const glm::dvec3& spacing_m,
                                 std::uint8_t label, std::size_t max_voxels);

}  // namespace hybrid
