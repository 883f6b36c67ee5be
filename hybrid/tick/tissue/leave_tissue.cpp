// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tick/tissue/leave_tissue.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>

#include "hybrid/tick/proxy/rigid_proxy.h"
#include "polygon/surface/rigid_surface.h"

namespace hybrid {
namespace {

constexpr double kMostPlaces = 1000.0;  // greatest number of places that a search tries in one direction

bool is_filled(const voxel::Lattice& lattice, const glm::dvec3& at) noexcept {
  std::array<int, 3> cell{};
  for (int d = 0; d < 3; ++d) {
    const auto ud = static_cast<std::size_t>(d);
    const double index = std::round(at[d] / lattice.spacing_m()[d]);
    if (!(index >= 0.0 && index < lattice.grid().dims[ud])) return false;
    cell[ud] = static_cast<int>(index);
  }
  return lattice.filled(lattice.grid().at(cell[0], cell[1], cell[2]));
}

// Does a tool at `point` touch tissue at rest? A tool that reaches no surface voxel is outside, unless its
// middle is in a filled voxel.
bool touches_tissue(const World& world, WorldState& state, const glm::dvec3& point) noexcept {
  if (state.soft.empty()) return false;
  for (std::size_t o = 0; o < state.soft.size(); ++o) {
    if (is_filled(state.soft[o]->lattice(), world.soft[o].to_body(point))) return true;
  }
  double furthest = 0.0;
  for (const auto& object : state.soft) furthest = std::max(furthest, object->reach(world.tool.radius_m));
  const std::size_t count =
      state.map.soft_in(point - furthest, point + furthest, state.scratch.map_hits, state.map_trail);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t number = state.scratch.map_hits[i];
    std::size_t o = world.soft.size() - 1;
    while (world.soft[o].first_number > number) --o;
    const voxel::SoftObject& object = *state.soft[o];
    const voxel::VoxelId v = object.lattice().surface()[number - world.soft[o].first_number];
    const double reach = object.reach(world.tool.radius_m);
    if (glm::distance(world.soft[o].to_scene(object.position(v)), point) < reach) return true;
  }
  return count ==
         state.scratch.map_hits.size();  // if full: further voxels may not fit, and some of them may touch
}

bool touches_rigid(const World& world, const WorldState& state, const glm::dvec3& point) noexcept {
  for (std::size_t o = 0; o < world.rigid.size(); ++o) {
    const polygon::RigidSurface& surface = *world.rigid[o].surface;
    const glm::dvec3 at = state.rigid[o].frame.to_body(point);
    polygon::NearPoint near;
    if (surface.inside(at) || surface.nearest(at, world.contact_radius_m(), near)) return true;
  }
  return false;
}

bool is_outside(const World& world, WorldState& state, const glm::dvec3& point) noexcept {
  return !touches_tissue(world, state, point) && !touches_rigid(world, state, point);
}

// Moves the proxy by `far_m` along an axis or diagonal of this frame, if a place there is outside everything.
bool move_along_axes(const World& world, WorldState& state, const glm::dvec3& from, const glm::dquat& frame,
                     double far_m) noexcept {
  for (int n = 0; n < 27; ++n) {
    const glm::dvec3 to(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
    if (n == 13) continue;
    const glm::dvec3 point = from + far_m * (frame * glm::normalize(to));
    if (!is_outside(world, state, point)) continue;
    state.proxy_m = point;
    return true;
  }
  return false;
}

// The places that a search tries: up to `way_m` away, `step_m` apart.
struct Search {
  double step_m = std::numeric_limits<double>::max(), way_m = 0.0;
};

Search search_of_tissue(const World& world, const WorldState& state) noexcept {
  Search search;
  for (const auto& object : state.soft) {
    const auto& dims = object->lattice().grid().dims;
    search.step_m = std::min(search.step_m, object->lattice().min_spacing_m());
    search.way_m += glm::length(object->lattice().spacing_m() * glm::dvec3(dims[0], dims[1], dims[2]));
  }
  search.way_m += 2.0 * world.tool.radius_m;
  return search;
}

}  // namespace

bool leave_tissue(const World& world, WorldState& state) noexcept {
  const glm::dvec3 from = state.proxy_m;
  if (!touches_tissue(world, state, from)) return true;
  const auto [step, way] = search_of_tissue(world, state);
  for (double far = step; far <= way + step; far += step) {
    for (const SoftBody& body : world.soft) {
      if (move_along_axes(world, state, from, body.pose.rotation, far)) return true;
    }
  }
  return false;
}

bool start_outside(const World& world, WorldState& state, const glm::dvec3& device_m, const glm::dvec3& from,
                   const glm::dvec3& towards) noexcept {
  const bool outside_rigid = start_proxy(world, state, from);
  state.device_m = device_m;
  if (outside_rigid && !touches_tissue(world, state, state.proxy_m)) return true;
  const double length = glm::length(towards);
  const double radius = world.contact_radius_m(), way = world.extent_m + radius;
  const double step = std::max(0.5 * radius, world.extent_m / kMostPlaces);
  for (double far = step; length > 0.0 && far <= way; far += step) {
    const glm::dvec3 point = from + towards * (far / length);
    if (!is_outside(world, state, point)) continue;
    state.proxy_m = point;
    return true;
  }
  for (double far = step; far <= way; far += step) {
    if (move_along_axes(world, state, from, glm::dquat(1.0, 0.0, 0.0, 0.0), far)) return true;
  }
  return false;
}

}  // namespace hybrid
