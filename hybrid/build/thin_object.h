// SPDX-License-Identifier: GPL-3.0-or-later
// Thins the interior of a soft object (`thinning`), after its volume is read and before its lattice is made.
#pragma once

#include "hybrid/build/build_objects.h"

namespace hybrid {

// Thins the volume as the scene asks, and gives struts their material. Struts in place of an anchored label
// become anchors. Notes the saving in `notes` and `body`. Throws SceneError.
void thin_object(const Scene& scene, const SoftDescription& description, voxel::LabelVolume& volume,
                 voxel::LatticeOptions& options, SoftBody& body, std::vector<BuildNote>& notes);

}  // namespace hybrid
