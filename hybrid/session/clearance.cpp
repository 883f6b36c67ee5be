// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/session/clearance.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

namespace hybrid {
namespace {

// Distance from the surface (unit: spacings) beyond which the distance to the half-space is used.
constexpr double kExactWithin = 1.0;

// Distance from a voxel's ball to the rigid surfaces themselves, not to their half-spaces; at most `range_m`.
double rigid_gap(const World& world, const WorldState& state, const glm::dvec3& at, double radius_m,
                 double range_m) noexcept {
  double gap = range_m;
  const std::uint64_t mask = state.map.rigid_in(at - range_m, at + range_m);
  for (std::uint32_t o = 0; o < world.rigid.size(); ++o) {
    if ((mask & OccupancyMap::rigid_bit(o)) == 0) continue;
    const glm::dvec3 in_body = state.rigid[o].frame.to_body(at);
    const bool inside = world.rigid[o].surface->inside(in_body);
    polygon::NearPoint near;
    if (!world.rigid[o].surface->nearest(in_body, range_m + radius_m, near)) continue;
    const double distance = glm::length(in_body - near.point);
    gap = std::min(gap, (inside ? -distance : distance) - radius_m);
  }
  return gap;
}

}  // namespace

Clearance clearance(const World& world, const WorldState& state) noexcept {
  constexpr double none = std::numeric_limits<double>::infinity();
  double rigid = none, soft = none;
  for (std::size_t o = 0; o < state.soft.size(); ++o) {
    const voxel::SoftObject& object = *state.soft[o];
    const auto surface = object.lattice().surface();
    const auto obstacles = object.obstacles();
    const double exact_m = kExactWithin * object.lattice().max_spacing_m();
    for (std::size_t s = 0; s < surface.size() && s < obstacles.size(); ++s) {
      const voxel::Obstacle& obstacle = obstacles[s];
      if (obstacle.normal == glm::vec3(0.0F) || object.lattice().anchored(surface[s])) continue;
      const double bound_gap = glm::dot(glm::dvec3(obstacle.normal), object.displacement(surface[s])) -
                               static_cast<double>(obstacle.bound);
      if (bound_gap > exact_m) {
        rigid = std::min(rigid, bound_gap);
      } else {
        rigid = std::min(rigid, rigid_gap(world, state, world.soft[o].to_scene(object.position(surface[s])),
                                          object.voxel_radius(), exact_m));
      }
    }
  }
  for (const FacetContact& pair : state.facet_contacts) {
    const auto [a, b] = world.soft_pairs[pair.soft_pair];
    soft = std::min(soft, voxel::gap_of_pair({*state.soft[a], world.soft[a].pose},
                                             {*state.soft[b], world.soft[b].pose}, pair.pressed));
  }
  const auto nan_if_infinite = [](double gap) {
    return std::isfinite(gap) ? gap : std::numeric_limits<double>::quiet_NaN();
  };
  return {nan_if_infinite(rigid), nan_if_infinite(soft)};
}

}  // namespace hybrid
