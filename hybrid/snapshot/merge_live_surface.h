// SPDX-License-Identifier: GPL-3.0-or-later
// The drawn surface of tissue under asynchronous relaxation: that of the relaxation thread, and
// around the tool, where that one may be some ticks old, the points of the tick.
#pragma once

#include "hybrid/snapshot/snapshot.h"

namespace hybrid {

// Completes in `shown` what `snapshot` (of fill_moved_near()) leaves to `surfaces`. For the drawing thread.
void merge_live_surface(const DrawnScene& scene, const Snapshot& snapshot, const MovedSurfaces& surfaces,
                        Snapshot& shown);

}  // namespace hybrid
