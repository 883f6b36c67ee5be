// SPDX-License-Identifier: GPL-3.0-or-later
// Removal of overlaps between the objects of a scene, before lattices are made.
#pragma once

#include <cstddef>
#include <vector>

#include "hybrid/world/world_state.h"
#include "voxel/volume/label_volume.h"

namespace hybrid {

// Removes voxels inside a rigid solid, or nearer than half a spacing to a rigid surface, so that there is no
// force before contact. Appends to `anchored` the voxels within `anchor_m` of a fixed rigid surface, which
// become anchors. Returns how many voxels were removed.
std::size_t remove_rigid_overlap(const std::vector<RigidObject>& rigid, voxel::LabelVolume& volume,
                                 double anchor_m, std::vector<std::size_t>& anchored);

// Removes from `first` the voxels whose centres lie in filled voxels of `later`. Returns how many.
std::size_t remove_soft_overlap(voxel::LabelVolume& first, const voxel::LabelVolume& later);

}  // namespace hybrid
