// SPDX-License-Identifier: GPL-3.0-or-later
// Two soft objects that press on one another: pairs of surface voxels, each a ball of its own radius.
#pragma once

#include <glm/gtc/quaternion.hpp>
#include <glm/vec3.hpp>

#include "voxel/sparse/soft_object.h"

namespace voxel::sparse {

// Where an object's volume frame lies: point_in_scene = origin + rotation · point_in_body.
struct BodyPose {
  glm::dvec3 origin{0.0};
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};
};

struct PosedObject {
  SoftObject& object;
  const BodyPose& pose;
};

// One step of block Gauss-Seidel on a pair: both voxels go to the joint minimum of their link energies
// subject to not overlapping. Overlap is shared in inverse proportion to stiffness, and at rest the two press
// with equal and opposite force. Returns the distance between the two surfaces afterwards (unit: meter; 0 in
// contact).
double relax_pair(const PosedObject& a, VoxelId va, const PosedObject& b, VoxelId vb) noexcept;

}  // namespace voxel::sparse
