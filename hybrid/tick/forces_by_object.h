// SPDX-License-Identifier: GPL-3.0-or-later
// Splits the force on the hand by object.
#pragma once

#include <glm/vec3.hpp>

#include "hybrid/world/world_state.h"

namespace hybrid {

// Fills state.feel: each object's part of the felt force. The parts of the rigid objects are those of
// state.rigid_force_N. The parts of the soft objects sum up to `soft_N`, the force that all of them exert on
// the proxy (scene frame).
//
// A reaction knows the links of pressed voxels only. The difference to `soft_N` is carried by limits, anchors
// and voxels that jam the tool. The objects near the tool share it as springs in parallel. Along the normals
// of planes that stopped the tool an object is as good as rigid.
void split_by_object(const World& world, WorldState& state, const glm::dvec3& soft_N) noexcept;

}  // namespace hybrid
