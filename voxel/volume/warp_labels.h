// SPDX-License-Identifier: GPL-3.0-or-later
// Warps a label volume by a displacement field and resamples it onto the volume's own lattice.
// Tissue without folds has no hole afterwards, and nothing is iterated: voxels are boxes that tile the tissue
// before and after. Displacements are in meters along the axes of the volume.
#pragma once

#include "voxel/volume/write_volume.h"

namespace voxel {

// The labels moved by their displacement. Each voxel is a box of six tetrahedra. A corner of a box moves by
// the mean displacement of the filled voxels around it. A voxel of the result has the label of the box that
// contains its centre. The boxes tile the tissue before and after: stretched tissue has no hole, which moving
// voxel by voxel would leave. The field is not inverted: an inversion iterates, and fails where tissue is
// sheared by more than its own thickness. Where tissue has folded over itself, the first box in the order of
// the voxels wins, except that boxes at rest always win.
//
// `displacement` is in meters along the axes of the volume, at the voxels' places at rest; it is ignored
// where the label is 0. The result is on the same lattice, enlarged by whole voxels if tissue left it. Extra
// memory: the result (one byte per voxel) and a few slices. Throws std::runtime_error if a displacement is
// not finite or the result has more than `max_voxels`.
LabelVolume warp_labels(const VolumeFrame& frame, const LabelSlice& labels, const VectorSlice& displacement,
                        std::size_t max_voxels);

}  // namespace voxel
