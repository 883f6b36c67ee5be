// SPDX-License-Identifier: GPL-3.0-or-later
// Rigid bodies that move in the tick, and the proxy that they push or carry.
#pragma once

#include "hybrid/world/world_state.h"

namespace hybrid {

// Moves every body on by dt_s: along its path, or freely, pushed by what pressed on it in the last tick. A
// free body that tissue carries, and that would hardly move any more, rests.
void move_bodies(const World& world, WorldState& state, double dt_s) noexcept;

// Body number `object` is now at `pose` (body to scene). In the body's frame the proxy moves, and is swept
// there as anywhere: so a body that moves into it pushes it, and never passes over it, at any speed. A proxy
// that sticks to the body (friction) is carried with it. Where the body would push the proxy into another
// one, it goes aside; where there is no room left, a fault is set and the other one's surface holds.
void set_rigid_pose(const World& world, WorldState& state, std::uint32_t object, const Pose& pose) noexcept;

}  // namespace hybrid
