// SPDX-License-Identifier: GPL-3.0-or-later
// Writes the moving parts of a world to a snapshot for graphics (make_drawn_scene.h has the fixed parts).
#pragma once

#include "hybrid/snapshot/snapshot.h"
#include "hybrid/tick/tick.h"
#include "hybrid/world/world_state.h"

namespace hybrid {

// The snapshot of this moment, for a picture.
[[nodiscard]] Snapshot take_snapshot(const World& world, const WorldState& state, const TickResult& tick,
                                     double t_s);
// Fills the places of everything that moves. Allocates nothing once the vectors have their sizes.
void fill_moved(const World& world, const WorldState& state, Snapshot& snapshot);
// Like fill_moved(), but for use within a tick that must not wait. A soft object on nested patches gets only
// the patches' nodes. A soft object under asynchronous relaxation gets only the neighbourhood of the tool.
void fill_moved_near(const World& world, const WorldState& state, Snapshot& snapshot);
// Fills the displacements at `asked`. `in_tick`: only for objects that get no displacements from the patches
// of fill_moved_near() or from the relaxation thread.
void fill_asked(const World& world, const WorldState& state, const AskedPoints& asked, bool in_tick,
                Snapshot& snapshot);
// Fills the present values of DrawnScene::editable. Allocates nothing once `values` has its size.
void fill_values(const World& world, const WorldState& state, const DrawnScene& drawn, Snapshot& snapshot);
// Adds the displacements within each touched soft object, on a coarse grid: for the cut of a picture.
void fill_inside(const World& world, const WorldState& state, Snapshot& snapshot);

}  // namespace hybrid
