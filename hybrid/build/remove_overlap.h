// SPDX-License-Identifier: GPL-3.0-or-later
// Where objects overlap as a scene places them: who gives way, before lattices are made.
#pragma once

#include <cstddef>
#include <vector>

#include "hybrid/world/world_state.h"
#include "voxel/volume/label_volume.h"

namespace hybrid {

// Takes out voxels that lie in a rigid solid or nearer than half a spacing to a rigid surface, so that
// nothing is felt before contact; and gathers those within `anchor_m` of one that stays, which will hold
// them. Returns how many were carved.
std::size_t carve_by_rigid(const std::vector<RigidObject>& rigid, voxel::LabelVolume& volume, double anchor_m,
                           std::vector<std::size_t>& anchored);

// Voxels of `first` that lie in filled voxels of `later` are taken out of it. Returns how many.
std::size_t carve_by_soft(voxel::LabelVolume& first, const voxel::LabelVolume& later);

}  // namespace hybrid
