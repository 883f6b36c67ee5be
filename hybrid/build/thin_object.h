// SPDX-License-Identifier: GPL-3.0-or-later
// Interior thinning of a soft object (`thinning`), between its volume and its lattice.
#pragma once

#include "hybrid/build/build_objects.h"

namespace hybrid {

// Thins the volume as the scene asks, gives struts their material and the anchors of their labels, and notes
// the saving in `notes` and `body`. Throws SceneError.
void thin_object(const Scene& scene, const SoftDescription& description, voxel::LabelVolume& volume,
                 voxel::LatticeOptions& options, SoftBody& body, std::vector<BuildNote>& notes);

}  // namespace hybrid
