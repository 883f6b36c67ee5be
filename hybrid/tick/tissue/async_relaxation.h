// SPDX-License-Identifier: GPL-3.0-or-later
// The background stage of the tick: tissue away from the contact relaxes towards its equilibrium. It relaxes
// in the tick, by a budget of voxel updates, or asynchronously (hybrid/world/async_relaxation.h).
#pragma once

#include "hybrid/world/world_state.h"

namespace hybrid {

// Ticks between a result and the next submission with Arrival::at_once. Then each result costs a cycle over
// the whole object, at any spacing.
inline constexpr std::uint64_t kTicksBetweenAtOnce = 50;

// From now on soft objects are relaxed asynchronously. Objects with plasticity, objects on nested patches and
// all from the 65th on stay in the tick. Allocates. With Arrival::thread the caller must also run a
// RelaxationThread.
void start_async_relaxation(WorldState& state, Arrival arrival);
// Does start_async_relaxation() apply to soft object `o`?
[[nodiscard]] bool relaxes_asynchronously(const WorldState& state, std::size_t o);

// The stage: at most one exchange (a submission, a result, or a part of one) per object and tick.
void relax_background(const World& world, WorldState& state) noexcept;

}  // namespace hybrid
