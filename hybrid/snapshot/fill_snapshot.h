// SPDX-License-Identifier: GPL-3.0-or-later
// From a world that is touched to what graphics may know of what moves in it (make_drawn_scene.h has what stays).
#pragma once

#include "hybrid/snapshot/snapshot.h"
#include "hybrid/world/world_state.h"

namespace hybrid {

// Where what moves is, filled in place: no allocation once its vectors have their size.
void fill_moved(const World& world, const WorldState& state, Snapshot& snapshot);
// The same from within a tick that must not wait: of a soft object relaxed apart, only what is near the tool.
void fill_moved_near(const World& world, const WorldState& state, Snapshot& snapshot);

}  // namespace hybrid
