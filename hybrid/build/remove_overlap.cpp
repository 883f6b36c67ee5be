// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/build/remove_overlap.h"

#include <algorithm>
#include <glm/common.hpp>
#include <glm/matrix.hpp>
#include <glm/vector_relational.hpp>

namespace hybrid {
namespace {

constexpr double kQueryAhead = 32.0;  // spacings by which a distance query looks beyond the decision range

// Distance to the nearest rigid surface within `range`, to the nearest fixed one, and whether the point is
// inside a rigid solid.
struct RigidDistance {
  double distance, fixed;
  bool inside;
};
RigidDistance rigid_distance(const std::vector<RigidObject>& rigid, const glm::dvec3& p, double range) {
  RigidDistance result{range, range, false};
  for (const RigidObject& object : rigid) {
    const glm::dvec3 in_body = object.to_body(p);
    polygon::NearPoint near;
    double& least = object.motion.moves() ? result.distance : result.fixed;
    if (object.surface->nearest(in_body, least, near)) least = near.distance;
    result.distance = std::min(result.distance, result.fixed);
    const glm::dvec3 low = object.surface->lower(), high = object.surface->upper();
    const bool within =
        glm::all(glm::greaterThanEqual(in_body, low)) && glm::all(glm::lessThanEqual(in_body, high));
    result.inside = result.inside || (within && object.surface->inside(in_body));
  }
  return result;
}

}  // namespace

std::size_t remove_rigid_overlap(const std::vector<RigidObject>& rigid, voxel::LabelVolume& volume,
                                 double anchor_m, std::vector<std::size_t>& anchored) {
  const double h = std::min({volume.spacing_m.x, volume.spacing_m.y, volume.spacing_m.z});
  const double clear = std::max(0.5 * h, anchor_m);
  std::size_t removed = 0;
  for (int k = 0; k < volume.dims[2]; ++k) {
    for (int j = 0; j < volume.dims[1]; ++j) {
      for (int i = 0; i < volume.dims[0]; ++i) {
        if (volume.labels[volume.index(i, j, k)] == 0) continue;
        const glm::dvec3 p = volume.origin_m + volume.rotation * (glm::dvec3(i, j, k) * volume.spacing_m);
        const RigidDistance near = rigid_distance(rigid, p, clear + kQueryAhead * h);
        // No surface is nearer to p than near.distance. So the next voxels of the row that must be further
        // than `clear` from any surface get the same result without a query.
        const int run = std::max(0, static_cast<int>((near.distance - clear) / volume.spacing_m.x));
        const int last = std::min(volume.dims[0] - 1, i + run);
        for (; i <= last; ++i) {
          std::uint8_t& label = volume.labels[volume.index(i, j, k)];
          if (label == 0) continue;
          if (near.inside || (run == 0 && near.distance < 0.5 * h)) {
            label = 0;
            ++removed;
          } else if (run == 0 && near.fixed <= anchor_m) {
            anchored.push_back(volume.index(i, j, k));
          }
        }
        --i;
      }
    }
  }
  return removed;
}

std::size_t remove_soft_overlap(voxel::LabelVolume& first, const voxel::LabelVolume& later) {
  std::size_t removed = 0;
  const glm::dquat to_later = glm::inverse(later.rotation) * first.rotation;
  const glm::dvec3 shift = glm::inverse(later.rotation) * (first.origin_m - later.origin_m);
  for (int k = 0; k < first.dims[2]; ++k) {
    for (int j = 0; j < first.dims[1]; ++j) {
      for (int i = 0; i < first.dims[0]; ++i) {
        std::uint8_t& label = first.labels[first.index(i, j, k)];
        if (label == 0) continue;
        const glm::dvec3 c =
            glm::round((shift + to_later * (glm::dvec3(i, j, k) * first.spacing_m)) / later.spacing_m);
        bool within = true;
        for (int d = 0; d < 3; ++d)
          within = within && c[d] >= 0.0 && c[d] < later.dims[static_cast<std::size_t>(d)];
        if (!within) continue;
        if (later.labels[later.index(static_cast<int>(c.x), static_cast<int>(c.y), static_cast<int>(c.z))] ==
            0)
          continue;
        label = 0;
        ++removed;
      }
    }
  }
  return removed;
}

}  // namespace hybrid
