// SPDX-License-Identifier: GPL-3.0-or-later
// Conversions between label volumes and meshes: a surface from labels, labels from a surface, and growing of
// labels.
#pragma once

#include <cstddef>

#include "polygon/mesh/mesh.h"
#include "voxel/volume/label_volume.h"

namespace hybrid {

// Surface of all voxels whose label is not 0, in the volume's frame (m), by surface nets (Gibson 1998). It is
// closed and oriented outwards. Boundary cells have one vertex for each sheet, and quads are split into
// triangles. `smoothing` is the number of smoothing passes, in which each vertex stays within its cell.
polygon::TriangleMesh surface_from_labels(const voxel::LabelVolume& volume, int smoothing);

// Keeps only the largest 6-connected piece. `fill_cavities`: also gives label 1 to enclosed empty space.
void keep_largest_piece(voxel::LabelVolume& volume, bool fill_cavities);

// Adds label 1 within `distance_m` (Euclidean) of filled voxels; the lattice is enlarged as needed.
voxel::LabelVolume grow_labels(const voxel::LabelVolume& volume, double distance_m);

// Gives `label` to every voxel whose centre is inside a closed mesh, by parity along lattice rows. The
// volume's frame is the body's frame up to origin_m. Throws std::invalid_argument with the numbers: the mesh
// is not closed, the lattice is above max_voxels, or nothing is inside.
voxel::LabelVolume voxelise_mesh(const polygon::TriangleMesh& mesh, const glm::dvec3& spacing_m,
                                 std::uint8_t label, std::size_t max_voxels);

}  // namespace hybrid
