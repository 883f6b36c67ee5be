// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/pair_contact.h"

#include <algorithm>
#include <glm/geometric.hpp>

namespace voxel {
namespace {

constexpr double kLeastSide = 0.1;  // surfaces that look the same way say nothing of who is where

struct End {
  glm::dvec3 free_place;  // where its links and the other pairs would have it, scene frame
  glm::dvec3 compliance;  // per body axis (m/N); 0 where it is anchored
};

End end_of(const PosedObject& o, VoxelId v) noexcept {
  const glm::dvec3 w = o.object.compliance(v);
  const glm::dvec3 u = o.object.free_displacement(v) + w * o.object.pair_load(v);
  return {o.pose.origin + o.pose.rotation * (o.object.lattice().rest(v) + u), w};
}

void place(const PosedObject& o, VoxelId v, const glm::dvec3& in_scene) noexcept {
  const glm::dvec3 in_body = glm::inverse(o.pose.rotation) * (in_scene - o.pose.origin);
  o.object.move(v, in_body - o.object.lattice().rest(v));
}

void press(const PosedObject& o, VoxelId v, const glm::dvec3& force_N) noexcept {
  o.object.add_pair_load(v, glm::inverse(o.pose.rotation) * force_N);
}

glm::dvec3 between(const PosedObject& a, const PosedObject& b, const PressedPair& pair) noexcept {
  return (b.pose.origin + b.pose.rotation * b.object.position(pair.b)) -
         (a.pose.origin + a.pose.rotation * a.object.position(pair.a));
}

// From the first to the second, on the side where that belongs: mirrored where they passed one another.
glm::dvec3 direction(const glm::dvec3& now, const glm::dvec3& side) noexcept {
  const double length = glm::length(now);
  if (!(length > 0.0)) return side != glm::dvec3(0.0) ? side : glm::dvec3(0.0, 0.0, 1.0);
  const double passed = std::min(glm::dot(now, side), 0.0);
  return (now - 2.0 * passed * side) / length;
}

}  // namespace

glm::dvec3 side_of_pair(const PosedObject& a, VoxelId in_a, const PosedObject& b, VoxelId in_b) noexcept {
  const glm::dvec3 side =
      a.pose.rotation * a.object.lattice().outward(in_a) - b.pose.rotation * b.object.lattice().outward(in_b);
  const double length = glm::length(side);
  return length > kLeastSide ? side / length : glm::dvec3(0.0);
}

void load_pair(const PosedObject& a, const PosedObject& b, const PressedPair& pair) noexcept {
  press(a, pair.a, -pair.force_N);
  press(b, pair.b, pair.force_N);
}

double relax_pair(const PosedObject& a, const PosedObject& b, PressedPair& pair) noexcept {
  load_pair(a, b, {pair.a, pair.b, -pair.force_N, pair.side});  // its own share is found anew
  pair.force_N = glm::dvec3(0.0);
  End ea = end_of(a, pair.a), eb = end_of(b, pair.b);
  const double apart = a.object.voxel_radius() + b.object.voxel_radius();
  // The direction is that of the voxels as they are: their free places may lie on the wrong side of one
  // another.
  const glm::dvec3 n = direction(between(a, b, pair), pair.side);
  const double overlap = apart - glm::dot(eb.free_place - ea.free_place, n);
  if (overlap > 0.0) {
    const glm::dvec3 na = glm::inverse(a.pose.rotation) * n, nb = glm::inverse(b.pose.rotation) * n;
    const double wa = glm::dot(na, ea.compliance * na), wb = glm::dot(nb, eb.compliance * nb);
    if (wa + wb > 0.0) {
      const double force = overlap / (wa + wb);  // N, equal and opposite
      ea.free_place -= a.pose.rotation * (force * ea.compliance * na);
      eb.free_place += b.pose.rotation * (force * eb.compliance * nb);
      pair.force_N = force * n;
      load_pair(a, b, pair);
    }
  }
  place(a, pair.a, ea.free_place);
  place(b, pair.b, eb.free_place);
  return glm::length(between(a, b, pair)) - apart;
}

}  // namespace voxel
