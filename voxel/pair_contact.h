// SPDX-License-Identifier: GPL-3.0-or-later
// Two soft objects that press on one another: pairs of surface voxels, each a ball of its own radius.
#pragma once

#include <glm/gtc/quaternion.hpp>
#include <glm/vec3.hpp>

#include "voxel/soft_object.h"

namespace voxel {

// Where an object's volume frame lies: point_in_scene = origin + rotation · point_in_body.
struct BodyPose {
  glm::dvec3 origin{0.0};
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};
};

struct PosedObject {
  SoftObject& object;
  const BodyPose& pose;
};

// Two voxels that press on one another, and the force on the second (scene frame, N), equal and opposite to
// that on the first.
struct PressedPair {
  VoxelId a = 0, b = 0;
  glm::dvec3 force_N{0.0};
  glm::dvec3 side{0.0};  // where the second belongs, seen from the first (scene frame, unit); 0: anywhere
};

// The side of a pair that is made: out of the first object, and into the second.
glm::dvec3 side_of_pair(const PosedObject& a, VoxelId in_a, const PosedObject& b, VoxelId in_b) noexcept;

// What a pair presses its voxels with, added to what their objects know of. Before a round of relax_pair():
// SoftObject::clear_pair_load() on all voxels of pairs, then this once a pair; so roundings of what is added
// and taken away do not add up.
void load_pair(const PosedObject& a, const PosedObject& b, const PressedPair& pair) noexcept;

// One step of block Gauss-Seidel on a pair: both voxels go to the joint minimum of their link energies, under
// the loads of the other pairs they are in, subject to not overlapping. Overlap is shared in inverse
// proportion to stiffness, and at rest the two press with equal and opposite force, also where several pairs
// share a voxel. Voxels that passed one another press as if they had not: pushed further the way they went,
// the voxels of two surfaces interlock, and hold one another for ever. Returns the distance between the two
// surfaces afterwards (unit: meter; 0 in contact).
double relax_pair(const PosedObject& a, const PosedObject& b, PressedPair& pair) noexcept;

}  // namespace voxel
