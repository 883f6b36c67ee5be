// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/sparse/pair_contact.h"

#include <glm/geometric.hpp>

namespace voxel::sparse {
namespace {

struct End {
  glm::dvec3 free_place;  // where its links alone would have it, scene frame
  glm::dvec3 compliance;  // per body axis (m/N); 0 where it is anchored
};

End end_of(const PosedObject& o, VoxelId v) noexcept {
  const glm::dvec3 free = o.object.lattice().rest(v) + o.object.free_displacement(v);
  return {o.pose.origin + o.pose.rotation * free, o.object.compliance(v)};
}

void place(const PosedObject& o, VoxelId v, const glm::dvec3& in_scene) noexcept {
  const glm::dvec3 in_body = glm::inverse(o.pose.rotation) * (in_scene - o.pose.origin);
  o.object.move(v, in_body - o.object.lattice().rest(v));
}

}  // namespace

double relax_pair(const PosedObject& a, VoxelId va, const PosedObject& b, VoxelId vb) noexcept {
  End ea = end_of(a, va), eb = end_of(b, vb);
  const double apart = a.object.voxel_radius() + b.object.voxel_radius();
  // The direction is that of the voxels as they are: their free places may lie on the wrong side of one
  // another.
  const glm::dvec3 now = (b.pose.origin + b.pose.rotation * b.object.position(vb)) -
                         (a.pose.origin + a.pose.rotation * a.object.position(va));
  const double length = glm::length(now);
  const glm::dvec3 n = length > 0.0 ? now / length : glm::dvec3(0.0, 0.0, 1.0);
  const double overlap = apart - glm::dot(eb.free_place - ea.free_place, n);
  if (overlap > 0.0) {
    const glm::dvec3 na = glm::inverse(a.pose.rotation) * n, nb = glm::inverse(b.pose.rotation) * n;
    const double wa = glm::dot(na, ea.compliance * na), wb = glm::dot(nb, eb.compliance * nb);
    if (wa + wb > 0.0) {
      const double force = overlap / (wa + wb);  // N, equal and opposite
      ea.free_place -= a.pose.rotation * (force * ea.compliance * na);
      eb.free_place += b.pose.rotation * (force * eb.compliance * nb);
    }
  }
  place(a, va, ea.free_place);
  place(b, vb, eb.free_place);
  const glm::dvec3 after = (b.pose.origin + b.pose.rotation * b.object.position(vb)) -
                           (a.pose.origin + a.pose.rotation * a.object.position(va));
  return glm::length(after) - apart;
}

}  // namespace voxel::sparse
