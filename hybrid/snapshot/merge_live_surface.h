// SPDX-License-Identifier: GPL-3.0-or-later
// The drawn surface of tissue under asynchronous relaxation. Most of it comes from the relaxation thread,
// whose surface may be some ticks old. Around the tool it comes from the points of the tick.
#pragma once

#include "hybrid/snapshot/snapshot.h"

namespace hybrid {

// Copies `snapshot` (filled by fill_moved_near()) to `shown`. Computes the displacements that the snapshot
// lacks, from its patches and dents and from `relaxed`. Does the same at the points `asked`, which may be
// null. For the drawing thread.
void merge_live_surface(const DrawnScene& scene, const Snapshot& snapshot, const RelaxedTissue& relaxed,
                        const AskedPoints* asked, Snapshot& shown);

}  // namespace hybrid
