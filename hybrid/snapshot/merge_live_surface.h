// SPDX-License-Identifier: GPL-3.0-or-later
// What a window shows of tissue that is relaxed on a thread of its own: everywhere what that thread knows,
// and round the tool, where that may be some ticks old, what the tick said.
#pragma once

#include "hybrid/snapshot/snapshot.h"

namespace hybrid {

// Fills in `shown` what `snapshot`, of fill_moved_near(), leaves to `surfaces`. For the thread that draws.
void show_live(const DrawnScene& scene, const Snapshot& snapshot, const MovedSurfaces& surfaces,
               Snapshot& shown);

}  // namespace hybrid
