// SPDX-License-Identifier: GPL-3.0-or-later
// Ghosts of a CompositeGrid: nodes outside the tissue with nodes of the tissue beside them. Finer levels
// interpolate between ghosts and tissue nodes.
#include <algorithm>

#include "voxel/composite/grid.h"

namespace voxel {
namespace {

using composite::index;

constexpr std::array<std::array<int, 3>, 26> kAround = [] {
  std::array<std::array<int, 3>, 26> around{};
  std::size_t n = 0;
  for (int k = -1; k <= 1; ++k) {
    for (int j = -1; j <= 1; ++j) {
      for (int i = -1; i <= 1; ++i) {
        if (i != 0 || j != 0 || k != 0) around[n++] = {i, j, k};
      }
    }
  }
  return around;
}();

}  // namespace

// Marks the nodes of the tissue: unknowns, and nodes that are anchored or linked to something.
void CompositeGrid::mark_tissue_nodes(const Level& level, bool near) noexcept {
  const auto& nodes = level.nodes;
  const std::size_t wide = index(nodes[0].count + 2), plane = wide * index(nodes[1].count + 2);
  std::fill_n(is_tissue_node_.begin(), plane * index(nodes[2].count + 2), std::uint8_t{0});
  for (int k = 0; k < nodes[2].count; ++k) {
    for (int j = 0; j < nodes[1].count; ++j) {
      std::uint8_t* const mark = is_tissue_node_.data() + index(k + 1) * plane + index(j + 1) * wide + 1;
      const std::size_t row = level.row(j, k);
      for (int i = 0; i < nodes[0].count; ++i) {
        const std::size_t n = row + index(i);
        bool any = level.inverse_diagonal[0][n] != 0.0F;
        for (std::size_t d = 0; d < 3 && !any; ++d) {
          any = level.weight[d][n] != 0.0F || level.weight[d][n - level.stride_along(d)] != 0.0F ||
                level.anchor_weight[d][n] != 0.0F;
        }
        any = any || (near && material_.is_anchored({level.at(0, i), level.at(1, j), level.at(2, k)}));
        mark[i] = any ? 1 : 0;
      }
    }
  }
}

// Finds the ghosts: nodes outside the tissue with nodes of the tissue beside them. Finer levels interpolate
// between ghosts and tissue nodes, so a ghost takes the mean of its tissue neighbours.
void CompositeGrid::find_ghosts(Level& level, bool near) noexcept {
  const auto& nodes = level.nodes;
  level.ghosts.clear();
  level.ghost_neighbours.clear();
  mark_tissue_nodes(level, near);
  const auto wide = static_cast<std::ptrdiff_t>(nodes[0].count) + 2, plane = wide * (nodes[1].count + 2);
  for (int k = 0; k < nodes[2].count; ++k) {
    for (int j = 0; j < nodes[1].count; ++j) {
      const std::uint8_t* const mark = is_tissue_node_.data() + (k + 1) * plane + (j + 1) * wide + 1;
      for (int i = 0; i < nodes[0].count; ++i) {
        if (mark[i] != 0) continue;
        const auto first = static_cast<std::uint32_t>(level.ghost_neighbours.size());
        for (const auto& way : kAround) {
          if (mark[i + way[0] + way[1] * wide + way[2] * plane] != 0 &&
              level.ghost_neighbours.size() < level.ghost_neighbours.capacity())
            level.ghost_neighbours.push_back(
                {static_cast<std::uint32_t>(level.node(i + way[0], j + way[1], k + way[2])), 0.0F});
        }
        const auto count = static_cast<std::uint32_t>(level.ghost_neighbours.size()) - first;
        if (count > 0 && level.ghosts.size() < level.ghosts.capacity()) {
          weigh_ghost(level, first);
          level.ghosts.push_back({static_cast<std::uint32_t>(level.node(i, j, k)), first, count});
        }
      }
    }
  }
}

// Weighs the neighbours from `first` on. Equal weights would let a node that barely touches the tissue bear
// as much of a ghost's load as stiff ones, and move without bound. An anchored node has the weight of the
// stiffest other.
void CompositeGrid::weigh_ghost(Level& level, std::size_t first) noexcept {
  float stiffest = 0.0F, sum = 0.0F;
  for (std::size_t n = first; n < level.ghost_neighbours.size(); ++n) {
    GhostNeighbour& of = level.ghost_neighbours[n];
    of.weight = level.diagonal[0][of.node] + level.diagonal[1][of.node] + level.diagonal[2][of.node];
    stiffest = std::max(stiffest, of.weight);
  }
  for (std::size_t n = first; n < level.ghost_neighbours.size(); ++n) {
    GhostNeighbour& of = level.ghost_neighbours[n];
    if (of.weight == 0.0F) of.weight = stiffest > 0.0F ? stiffest : 1.0F;
    sum += of.weight;
  }
  for (std::size_t n = first; n < level.ghost_neighbours.size(); ++n) level.ghost_neighbours[n].weight /= sum;
}

void CompositeGrid::fill_ghosts(const Level& level, float* values) const noexcept {
  for (const Ghost& g : level.ghosts) {
    float sum = 0.0F;
    for (std::uint32_t n = g.first; n < g.first + g.count; ++n)
      sum += level.ghost_neighbours[n].weight * values[level.ghost_neighbours[n].node];
    values[g.at] = sum;
  }
}

void CompositeGrid::distribute_ghost_loads(const Level& level, float* loads) const noexcept {
  for (const Ghost& g : level.ghosts) {
    const float load = loads[g.at];
    loads[g.at] = 0.0F;
    if (load == 0.0F) continue;
    for (std::uint32_t n = g.first; n < g.first + g.count; ++n)
      loads[level.ghost_neighbours[n].node] += level.ghost_neighbours[n].weight * load;
  }
}

}  // namespace voxel
