// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/snapshot/map_boxes.h"

#include <glm/common.hpp>
#include <glm/gtc/quaternion.hpp>

#include "polygon/mesh/is_finite.h"
#include "voxel/composite/grid.h"

namespace hybrid {
namespace {

void add_cells(const WorldState& state, std::vector<MapBox>& boxes) {
  const OccupancyMap& map = state.map;
  const double cell_m = map.cell_m();
  if (!polygon::is_finite(state.proxy_m) || !(cell_m > 0.0)) return;
  const glm::dvec3 first = glm::floor((state.proxy_m - map.origin()) / cell_m) - glm::dvec3(kCellsAlong / 2);
  for (int n = 0; n < kCellsAlong * kCellsAlong * kCellsAlong; ++n) {
    const glm::dvec3 at(n % kCellsAlong, n / kCellsAlong % kCellsAlong, n / (kCellsAlong * kCellsAlong));
    MapBox box{.corner_m = map.origin() + (first + at) * cell_m};
    for (std::size_t d = 0; d < 3; ++d) box.edges_m[d][static_cast<glm::length_t>(d)] = cell_m;
    // The middle of the cell alone: a box up to its faces would touch the cells beside it.
    const glm::dvec3 middle = box.corner_m + glm::dvec3(0.5 * cell_m), half(0.25 * cell_m);
    const auto add = [&](MapBox::Kind kind) {
      box.kind = kind;
      boxes.push_back(box);
    };
    if (map.rigid_in(middle - half, middle + half) != 0) add(MapBox::Kind::rigid);
    std::array<std::uint32_t, 1> any{};
    if (map.soft_in(middle - half, middle + half, any) > 0) add(MapBox::Kind::soft);
  }
}

void add_patches(const World& world, const WorldState& state, std::vector<MapBox>& boxes) {
  for (std::size_t o = 0; o < world.soft.size(); ++o) {
    const voxel::CompositeGrid* const grid = state.soft[o]->patches_in_use();
    if (grid == nullptr) continue;
    const SoftBody& body = world.soft[o];
    const glm::dvec3 spacing_m = state.soft[o]->lattice().spacing_m();
    for (std::size_t n = 0; n < grid->patch_count(); ++n) {
      const voxel::CompositeGrid::Nodes nodes = grid->nodes_of(n);
      MapBox box{.kind = MapBox::Kind::patch, .level = static_cast<std::uint32_t>(n)};
      const glm::dvec3 first(nodes.first[0], nodes.first[1], nodes.first[2]);
      box.corner_m = body.to_scene(first * spacing_m);
      for (std::size_t d = 0; d < 3; ++d) {
        glm::dvec3 edge(0.0);
        const auto axis = static_cast<glm::length_t>(d);
        edge[axis] = static_cast<double>((nodes.count[d] - 1) * nodes.step) * spacing_m[axis];
        box.edges_m[d] = body.pose.rotation * edge;
      }
      boxes.push_back(box);
    }
  }
}

}  // namespace

std::vector<MapBox> map_boxes(const World& world, const WorldState& state) {
  std::vector<MapBox> boxes;
  add_cells(state, boxes);
  add_patches(world, state, boxes);
  return boxes;
}

}  // namespace hybrid
