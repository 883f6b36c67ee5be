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
// A reaction contains only the forces of the pressed voxels' links. The rest of `soft_N` is carried by
// limits, by anchors and by voxels that jam the tool. The objects near the tool share this rest as springs in
// parallel. An object is as good as rigid along the normals of its planes that stopped the tool.
void split_by_object(const World& world, WorldState& state, const glm::dvec3& soft_N) noexcept;

}  // namespace hybrid
