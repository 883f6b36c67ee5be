// SPDX-License-Identifier: GPL-3.0-or-later
// Moves rigid bodies in the tick, and the proxy that they push or carry.
#pragma once

#include "hybrid/world/world_state.h"

namespace hybrid {

// Moves every body on by dt_s: along its path, or freely under the loads of the last tick. A free body on
// tissue that would hardly move any more comes to rest.
void move_bodies(const World& world, WorldState& state, double dt_s) noexcept;

// Sets the pose of body number `object` (body to scene). The proxy is swept in the body's frame. A body that
// moves into the proxy therefore pushes it and never passes over it, at any speed. A proxy that sticks to the
// body by friction is carried along. If the body would push the proxy into another body, the proxy goes
// aside. If there is no room left, fault_infeasible is set and the other body's surface prevails.
void set_rigid_pose(const World& world, WorldState& state, std::uint32_t object, const Pose& pose) noexcept;

}  // namespace hybrid
