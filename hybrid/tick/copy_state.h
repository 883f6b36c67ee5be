// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>

#include "hybrid/world/world_state.h"

namespace hybrid {

// A deep copy of the state; the constant lattices are shared. Tissue of the copy relaxes in the tick.
std::unique_ptr<WorldState> copy_state(const World& world, const WorldState& state);
// A copy that is only read or copied, and never ticks. It takes a fraction of the time and memory.
std::unique_ptr<WorldState> kept_copy(const World& world, const WorldState& state);

}  // namespace hybrid
