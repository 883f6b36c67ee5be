// SPDX-License-Identifier: GPL-3.0-or-later
// The drawn surface of tissue under asynchronous relaxation. It comes from the relaxation thread. Around the
// tool, where that surface may be some ticks old, it comes from the points of the tick.
#pragma once

#include "hybrid/snapshot/snapshot.h"

namespace hybrid {

// Copies `snapshot` (of fill_moved_near()) to `shown`, and computes the displacements that it lacks from its
// patches and dents and from `surfaces`. For the drawing thread.
void merge_live_surface(const DrawnScene& scene, const Snapshot& snapshot, const MovedSurfaces& surfaces,
                        Snapshot& shown);

}  // namespace hybrid
