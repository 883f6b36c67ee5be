// SPDX-License-Identifier: GPL-3.0-or-later
// A soft object's `thinning`, between its volume and its lattice.
#pragma once

#include "hybrid/build/build_objects.h"

namespace hybrid {

// Thins the volume as the scene says, gives the struts their material and their labels' anchors, and notes
// what was saved in `notes` and `body`. Throws SceneError.
void thin_object(const Scene& scene, const SoftDescription& description, voxel::LabelVolume& volume,
                 voxel::LatticeOptions& options, SoftBody& body, std::vector<BuildNote>& notes);

}  // namespace hybrid
