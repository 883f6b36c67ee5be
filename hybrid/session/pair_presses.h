// SPDX-License-Identifier: GPL-3.0-or-later
// The forces between objects as graphics shows them: by the indices of DrawnScene::objects.
#pragma once

#include <vector>

#include "hybrid/snapshot/snapshot.h"
#include "hybrid/world/world.h"
#include "hybrid/world/world_state.h"

namespace hybrid {

// The pairs of forces_between(). Allocates.
[[nodiscard]] std::vector<PairPress> pair_presses(const World& world, const WorldState& state);

}  // namespace hybrid
