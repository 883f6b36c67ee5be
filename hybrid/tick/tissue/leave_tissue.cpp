// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tick/tissue/leave_tissue.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>

#include "polygon/surface/rigid_surface.h"

namespace hybrid {
namespace {

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

}  // namespace

bool leave_tissue(const World& world, WorldState& state) noexcept {
  const glm::dvec3 from = state.proxy_m;
  if (state.soft.empty() || !touches_tissue(world, state, from)) return true;
  double step = std::numeric_limits<double>::max(), way = 0.0;
  for (std::size_t o = 0; o < state.soft.size(); ++o) {
    const voxel::Lattice& lattice = state.soft[o]->lattice();
    const auto& dims = lattice.grid().dims;
    step = std::min(step, lattice.min_spacing_m());
    way += glm::length(lattice.spacing_m() * glm::dvec3(dims[0], dims[1], dims[2]));
  }
  way += 2.0 * world.tool.radius_m;
  const auto steps = static_cast<std::int64_t>(way / step) + 1;
  for (std::int64_t k = 1; k <= steps; ++k) {
    const double far = static_cast<double>(k) * step;
    for (std::size_t o = 0; o < state.soft.size(); ++o) {
      for (int n = 0; n < 27; ++n) {
        const glm::dvec3 to(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
        if (n == 13) continue;
        const glm::dvec3 point = from + far * (world.soft[o].pose.rotation * glm::normalize(to));
        if (touches_tissue(world, state, point) || touches_rigid(world, state, point)) continue;
        state.proxy_m = point;
        return true;
      }
    }
  }
  return false;
}

}  // namespace hybrid
