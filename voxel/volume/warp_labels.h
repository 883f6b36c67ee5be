// SPDX-License-Identifier: GPL-3.0-or-later
// Warps a label volume by a displacement field and resamples it onto the volume's own lattice. Voxels are
// boxes that tile the tissue before and after, so tissue without folds has no holes afterwards. No iteration
// is needed. Displacements are in meters along the axes of the volume.
#pragma once

#include "voxel/volume/write_volume.h"

namespace voxel {

// Moves the labels by their displacement. Each voxel is a box of six tetrahedra. A corner of a box moves by
// the mean displacement of the filled voxels around it. A voxel of the result has the label of the box that
// contains its centre. The boxes tile the tissue before and after, so stretched tissue has no holes. Moving
// voxel by voxel would leave holes. The field is not inverted: an inversion iterates, and fails where tissue
// is sheared by more than its own thickness. Where tissue has folded over itself, a box that has not moved
// wins. If there is none, the first box in the order of the voxels wins.
//
// `displacement` is in meters along the axes of the volume, at the voxels' places at rest; it is ignored
// where the label is 0. The result is on the same lattice, enlarged by whole voxels if tissue left it. Extra
// memory: the result (one byte per voxel) and a few slices. Throws std::runtime_error if a displacement is
// not finite or the result has more than `max_voxels`.
LabelVolume warp_labels(const VolumeFrame& frame, const LabelSlice& labels, const VectorSlice& displacement,
                        std::size_t max_voxels);

}  // namespace voxel
