// SPDX-License-Identifier: GPL-3.0-or-later
// Labels where the tissue is now, as a label volume again.
#pragma once

#include "voxel/volume/write_volume.h"

namespace voxel {

// The labels moved by their displacement. Each voxel is a box whose eight corners go where the mean of the
// voxels around them goes; a voxel of the result has the label of the box that its centre lies in, found in
// the six tetrahedra of the box. The boxes tile the tissue before and after, so that it has no hole where it
// is stretched (as moving voxel by voxel would leave) and nothing is iterated (as inverting the field would
// need, which fails where the tissue is sheared by more than its own thickness). Where tissue has folded over
// itself, what did not move wins, then the first in the order of the voxels.
//
// `displacement` is in meters along the axes of the volume; it is asked at rest, and only counts where the
// label is not 0. The result is on the same lattice, enlarged by whole voxels where tissue left it. Extra
// memory: the result, one byte a voxel, and a few slices. Throws std::runtime_error in words: a displacement
// that is not finite, or a result of more than `max_voxels`.
LabelVolume warp_labels(const VolumeFrame& frame, const LabelSlice& labels, const VectorSlice& displacement,
                        std::size_t max_voxels);

}  // namespace voxel
