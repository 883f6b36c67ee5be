// SPDX-License-Identifier: GPL-3.0-or-later
// The patches of a CompositeGrid: their nodes, anchor weights, ghosts and the transfer to the next coarser
// level.
#include <algorithm>
#include <cmath>

#include "voxel/composite/grid.h"

namespace voxel {
namespace {

using composite::index;

constexpr std::size_t kFewerGhosts = 16;  // factor by which an object that fills its box has fewer ghosts
// A side with more than this share of anchors gets a node at or beyond it.
constexpr double kAnchoredSide = 0.25;
constexpr float kMinWeight = 1e-3F;   // of a full link: a link of less weight is missing
constexpr float kAlmostAll = 0.999F;  // of a full link: through a link of less weight there may be a gap
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

// The largest multiple of `step` that is <= at.
int floor_to_multiple(int at, int step) {
  return at >= 0 ? at / step * step : -((-at + step - 1) / step) * step;
}

}  // namespace

void CompositeGrid::allocate(Level& level, std::size_t l) const {
  level.step = 1 << l;
  level.log2_step = static_cast<int>(l);
  std::array<std::size_t, 3> most{};
  for (std::size_t d = 0; d < 3; ++d) {
    const int size = material_.high(d) - material_.low(d), all = size / level.step + 3;
    const int half = half_width_of(l);
    most[d] = index(half == kRefineAll || l >= covering_level_ ? all : std::min(all, 2 * half + 2));
    level.nodes[d].coarse.resize(most[d]);
    // Rows are read in vectors of 8, and beyond their end.
    level.nodes[d].weight_after.resize(most[d] + 16);
    level.nodes[d].lane_weight.resize(most[d] + 16);
    // Indexed by nodes of the next level, which may span the whole object.
    const auto next = std::max(most[d], index(size / (2 * level.step) + 3));
    for (auto* by_node :
         {&level.nodes[d].restrict_low, &level.nodes[d].restrict_own, &level.nodes[d].restrict_high})
      by_node->resize(next);
    level.nodes[d].fine.resize(next);
  }
  const std::size_t stride = (most[0] + 7) / 8 * 8, plane = stride * most[1];
  const std::size_t floats = plane * most[2] + 2 * (plane + stride + kPad) + 64;
  for (auto* arrays : {&level.u, &level.at_bound, &level.weight, &level.anchor_weight,
                       &level.inverse_diagonal, &level.diagonal}) {
    for (Floats& array : *arrays) array.assign(floats, 0.0F);
  }
  for (Floats* array :
       {&level.f, &level.restricted_u, &level.residual, &level.is_free, &level.is_active,
        &level.active_stiffness, &level.inverse_with_active, &level.bound[0], &level.bound[1]})
    array->assign(floats, 0.0F);
  if (material_.is_heterogeneous()) {
    for (auto* arrays : {&level.shape_weight, &level.anchor_distance, &level.limited_weight[0],
                         &level.limited_weight[1], &level.limited_weight[2], &level.limited_anchor_weight[0],
                         &level.limited_anchor_weight[1], &level.limited_anchor_weight[2]}) {
      for (Floats& array : *arrays) array.assign(floats, 0.0F);
    }
  }
  if (material_.has_own_limits()) {
    for (Floats& array : level.limit) array.assign(floats, 1.0F);
  }
  // There are about as many ghosts as surface nodes.
  const std::size_t share = material_.fills_box() ? kFewerGhosts : 1;
  if (!material_.fills_box() || material_.has_scattered_anchors())
    level.correction_springs.reserve(floats / 8);
  level.ghosts.reserve(floats / (8 * share));
  level.ghost_neighbours.reserve(floats / share);
}

// Gives before_move_ room for the nodes of any level that moves.
void CompositeGrid::allocate_for_moves() {
  std::size_t most = 0;
  for (std::size_t l = 0; l < covering_level_; ++l) {
    most = std::max(most, levels_[l].u[0].size());
    for (std::size_t d = 0; d < 3; ++d) {
      // The arrays get room, so that assigning the nodes of any level does not allocate.
      AxisNodes& nodes = before_move_.nodes[d];
      const AxisNodes& of = levels_[l].nodes[d];
      const auto grow = [](auto& room, const auto& like) { room.resize(std::max(room.size(), like.size())); };
      grow(nodes.coarse, of.coarse);
      grow(nodes.weight_after, of.weight_after);
      grow(nodes.lane_weight, of.lane_weight);
      grow(nodes.fine, of.fine);
      grow(nodes.restrict_low, of.restrict_low);
      grow(nodes.restrict_own, of.restrict_own);
      grow(nodes.restrict_high, of.restrict_high);
    }
  }
  for (auto* arrays : {&before_move_.u, &before_move_.at_bound}) {
    for (Floats& axis : *arrays) axis.assign(most, 0.0F);
  }
  for (std::size_t a = 0; material_.is_heterogeneous() && a < 3; ++a) {
    for (auto* arrays : {&before_move_.limited_weight[a], &before_move_.limited_anchor_weight[a]}) {
      for (Floats& axis : *arrays) axis.assign(most, 0.0F);
    }
  }
}

// Range of all nodes of the object. A node exists if its cell overlaps the bounding box of the voxels.
CompositeGrid::NodeRange CompositeGrid::whole_range(int step, std::size_t d) const noexcept {
  const int start = material_.low(d), end = material_.high(d);
  // At an anchored side the nodes include the side: anchors are searched on the links between nodes.
  return {floor_to_multiple(material_.anchored_share(d, 0) > kAnchoredSide ? start : start + step / 2, step),
          floor_to_multiple(
              end + (material_.anchored_share(d, 1) > kAnchoredSide ? step - 1 : (step - 1) / 2), step),
          false, false};
}

CompositeGrid::NodeRange CompositeGrid::node_range(std::size_t l, std::size_t d, int centre) const noexcept {
  const int step = levels_[l].step, half = half_width_of(l) * step;
  const int start = material_.low(d), end = material_.high(d);
  NodeRange span = whole_range(step, d);
  if (l >= covering_level_ || half < 0) return span;
  // The sides of the patch coincide with nodes of the next level.
  const int middle = floor_to_multiple(centre + step, 2 * step);
  span.open_low = middle - half > start;
  span.open_high = middle + half < end;
  if (span.open_low) span.low = middle - half;
  if (span.open_high) span.high = middle + half;
  return span;
}

void CompositeGrid::place_nodes(Level& level, std::size_t l, const Index3& centre) const noexcept {
  for (std::size_t d = 0; d < 3; ++d) {
    const NodeRange span = node_range(l, d, centre[d]);
    AxisNodes& nodes = level.nodes[d];
    nodes.open_low = span.open_low;
    nodes.open_high = span.open_high;
    nodes.begin = span.low;
    nodes.count = span.count(level.step);
    nodes.first = nodes.open_low ? 1 : 0;
    nodes.last = nodes.count - (nodes.open_high ? 2 : 1);
  }
  level.stride = index((level.nodes[0].count + 7) / 8 * 8);
  level.plane = level.stride * index(level.nodes[1].count);
}

void CompositeGrid::set_up_transfer(Level& fine, Level& coarse) const noexcept {
  for (std::size_t d = 0; d < 3; ++d) {
    AxisNodes& nodes = fine.nodes[d];
    const AxisNodes& to = coarse.nodes[d];
    std::fill(nodes.weight_after.begin(), nodes.weight_after.end(), 0.0F);
    for (int i = 0; i < nodes.count; ++i) {
      const int away = fine.at(d, i) - to.begin;
      // A fine node beyond an end of the coarse level takes the value of the end node.
      const int before = std::clamp(floor_to_multiple(away, coarse.step) / coarse.step, 0, to.count - 1);
      nodes.coarse[index(i)] = before;
      const bool between = away > before * coarse.step && before + 1 < to.count;
      nodes.weight_after[index(i)] = between ? 0.5F : 0.0F;
    }
    std::copy(nodes.weight_after.begin(), nodes.weight_after.end(), nodes.lane_weight.begin());
    const int way = fine.at(d, 0) - to.begin;
    nodes.base = floor_to_multiple(way, coarse.step) / coarse.step;
    nodes.odd = way != nodes.base * coarse.step;
    if (nodes.base < 0) nodes.lane_weight[0] = 1.0F;  // there is no coarse node before the first one
    std::fill(nodes.fine.begin(), nodes.fine.end(), kOutside);
    nodes.coarse_first = to.count;
    nodes.coarse_last = -1;
    for (int c = 0; c < to.count; ++c) {
      const int at = coarse.at(d, c);
      int here = (at - nodes.begin) / fine.step;
      const bool below = at < nodes.begin, above = here >= nodes.count;
      if ((below && nodes.open_low) || (above && nodes.open_high)) continue;
      // A coarse node may lie one node beyond the finer level, if its cell ends in the object.
      if (below) here = -1;
      if (above) here = nodes.count;
      const auto n = index(c);
      nodes.fine[n] = here;
      if (here < nodes.first && nodes.open_low) continue;
      if (here > nodes.last && nodes.open_high) continue;
      nodes.coarse_first = std::min(nodes.coarse_first, c);
      nodes.coarse_last = std::max(nodes.coarse_last, c);
      // Restriction uses the transposed interpolation weights.
      const auto share = [&](int i) {
        if (i < nodes.first || i > nodes.last) return 0.0F;
        const float part = nodes.weight_after[index(i)];
        return nodes.coarse[index(i)] == c ? 1.0F - part : nodes.coarse[index(i)] + 1 == c ? part : 0.0F;
      };
      nodes.restrict_low[n] = share(here - 1);
      nodes.restrict_own[n] = share(here);
      nodes.restrict_high[n] = share(here + 1);
    }
  }
  find_correction_springs(fine, coarse);
}

void CompositeGrid::assemble(Level& level) noexcept {
  weigh(level);
  if (material_.has_own_limits()) find_node_limits(level);
  Index3 low{}, high{};
  for (std::size_t d = 0; d < 3; ++d) {
    low[d] = level.at(d, 0);
    high[d] = level.at(d, level.nodes[d].count - 1);
  }
  const bool near = material_.anchor_near(low, high, 2 * level.step);
  find_anchor_weights(level, near);
  if (near && gathers_anchors(level)) gather_anchors(level);
  find_diagonal(level, near);
  find_ghosts(level, near);
}

// Removes links that a gap or an anchor interrupts, and finds the weights of the links to anchors.
void CompositeGrid::find_anchor_weights(Level& level, bool near) noexcept {
  const auto& nodes = level.nodes;
  const int step = level.step;
  const auto whole = static_cast<float>(step);
  const bool is_heterogeneous = material_.is_heterogeneous();
  const bool along_links = !gathers_anchors(level);
  level.has_gaps = false;
  level.has_anchors = false;
  for (Floats& weight : level.anchor_weight) std::fill(weight.begin(), weight.end(), 0.0F);
  for (int k = 0; k < nodes[2].count; ++k) {
    for (int j = 0; j < nodes[1].count; ++j) {
      // In an object that fills its box, rows without nearby anchors need no search.
      const bool anchors_near = near && row_near_anchors(level, j, k);
      if (!anchors_near && material_.fills_box()) continue;
      for (int i = 0; i < nodes[0].count; ++i) {
        const Index3 node{i, j, k}, at{level.at(0, i), level.at(1, j), level.at(2, k)};
        const std::size_t here = level.node(i, j, k);
        for (std::size_t d = 0; d < 3; ++d) {
          if (node[d] + 1 == nodes[d].count) continue;
          float& weight = level.weight[d][here];
          const float there = is_heterogeneous ? level.shape_weight[d][here] : weight;
          if (there < kMinWeight * whole) {
            weight = 0.0F;
            level.has_gaps = level.has_gaps || !material_.fills_box();
            continue;
          }
          Index3 after = at;
          after[d] += step;
          // The first anchor seen from either end of the link holds the node at that end, through the link's
          // tissue.
          const float stiff = is_heterogeneous ? weight / there : 1.0F;
          const CoarseMaterial::AnchorSearch anchors = anchors_near && along_links
                                                           ? material_.anchors_along(at, d, step)
                                                           : CoarseMaterial::AnchorSearch{};
          const float part =
              anchors.links > 0 ? std::min(1.0F, there / static_cast<float>(anchors.links)) : 0.0F;
          const auto weight_at = [&](int links) {
            return stiff * (part * whole * whole / static_cast<float>(links));
          };
          const std::size_t by = d == 0 ? 1 : d == 1 ? level.stride : level.plane;
          if (anchors.ahead > 0) level.anchor_weight[d][here] += weight_at(anchors.ahead);
          if (anchors.back > 0) level.anchor_weight[d][here + by] += weight_at(anchors.back);
          if (is_heterogeneous && anchors.ahead > 0)
            level.anchor_distance[d][here] = static_cast<float>(anchors.ahead);
          if (is_heterogeneous && anchors.back > 0)
            level.anchor_distance[d][here + by] = static_cast<float>(-anchors.back);
          const bool gap = step > 1 && there < kAlmostAll * whole && material_.is_filled(at) &&
                           material_.is_filled(after) && !material_.is_unbroken(at, d, step);
          if (anchors.ahead == 0 && anchors.back == 0 && !gap) continue;
          weight = 0.0F;
          level.has_anchors = level.has_anchors || !gap || anchors.ahead > 0 || anchors.back > 0;
          level.has_gaps = level.has_gaps || gap;
        }
      }
    }
  }
}

// Finds the node of a level nearest to a place: an unknown if `unknown`, else any node with links. False if
// the place lies outside the patch, or if no node of its cell qualifies.
bool CompositeGrid::nearest_node(const Level& level, const Index3& at, bool unknown, Index3& node) noexcept {
  Index3 other{};
  const int half = level.step / 2;
  for (std::size_t d = 0; d < 3; ++d) {
    const int way = at[d] - level.nodes[d].begin;
    if (way < -half || way > (level.nodes[d].count - 1) * level.step + half) return false;
  }
  for (std::size_t d = 0; d < 3; ++d) {
    const AxisNodes& nodes = level.nodes[d];
    const int way = at[d] - nodes.begin;
    node[d] = std::clamp((way + half) >> level.log2_step, 0, nodes.count - 1);
    if (node[d] < nodes.first || node[d] > nodes.last) return false;
    other[d] = std::clamp(node[d] + (way > node[d] * level.step ? 1 : -1), nodes.first, nodes.last);
  }
  const auto accepts = [&](const Index3& n) {
    return unknown ? level.inverse_diagonal[0][level.node(n[0], n[1], n[2])] != 0.0F : is_linked(level, n);
  };
  if (accepts(node)) return true;
  if (level.step == 1) return false;
  const Index3 nearest = node;
  int least = 4 * 3 * level.step * level.step;
  bool any = false;
  for (int corner = 1; corner < 8; ++corner) {
    Index3 n = nearest;
    int square = 0;
    for (std::size_t d = 0; d < 3; ++d) {
      if ((corner >> d & 1) != 0) n[d] = other[d];
      const int away = level.at(d, n[d]) - at[d];
      square += away * away;
    }
    if (square >= least || !accepts(n)) continue;
    least = square;
    node = n;
    any = true;
  }
  return any;
}

bool CompositeGrid::row_near_anchors(const Level& level, int j, int k) const noexcept {
  Index3 from{level.at(0, 0), level.at(1, j), level.at(2, k)}, to = from;
  to[0] = level.at(0, level.nodes[0].count - 1);
  return material_.anchor_near(from, to, 2 * level.step);
}

// Diagonal of the stiffness matrix and its inverse; 0 for nodes that do not move.
void CompositeGrid::find_diagonal(Level& level, bool near) noexcept {
  const auto& nodes = level.nodes;
  const std::size_t by_y = level.stride, by_z = level.plane;
  for (std::size_t a = 0; a < 3; ++a) {
    std::fill(level.inverse_diagonal[a].begin(), level.inverse_diagonal[a].end(), 0.0F);
    std::fill(level.diagonal[a].begin(), level.diagonal[a].end(), 0.0F);
  }
  for (int k = nodes[2].first; k <= nodes[2].last; ++k) {
    for (int j = nodes[1].first; j <= nodes[1].last; ++j) {
      const bool anchors_near = near && row_near_anchors(level, j, k);
      if (!anchors_near && material_.fills_box()) {
        const std::size_t row = level.row(j, k);
        const float *const x = level.weight[0].data() + row, *const y = level.weight[1].data() + row,
                           *const z = level.weight[2].data() + row;
        for (std::size_t a = 0; a < 3; ++a) {
          float *const all = level.diagonal[a].data() + row, *const inverse =
                                                                 level.inverse_diagonal[a].data() + row;
          const float sx = spring_N_per_m_[0][a], sy = spring_N_per_m_[1][a], sz = spring_N_per_m_[2][a];
          for (std::ptrdiff_t i = nodes[0].first; i <= nodes[0].last; ++i) {
            all[i] = sx * (x[i] + x[i - 1]) + sy * (y[i] + y[i - static_cast<std::ptrdiff_t>(by_y)]) +
                     sz * (z[i] + z[i - static_cast<std::ptrdiff_t>(by_z)]);
            inverse[i] = all[i] > 0.0F ? 1.0F / all[i] : 0.0F;
          }
        }
        continue;
      }
      for (int i = nodes[0].first; i <= nodes[0].last; ++i) {
        const std::size_t n = level.node(i, j, k);
        const std::array<float, 3> links{
            level.weight[0][n] + level.weight[0][n - 1] + level.anchor_weight[0][n],
            level.weight[1][n] + level.weight[1][n - by_y] + level.anchor_weight[1][n],
            level.weight[2][n] + level.weight[2][n - by_z] + level.anchor_weight[2][n]};
        if (links[0] + links[1] + links[2] == 0.0F) continue;
        const bool gathers =
            level.anchor_weight[0][n] + level.anchor_weight[1][n] + level.anchor_weight[2][n] > 0.0F;
        if (anchors_near && !(gathers_anchors(level) && gathers) &&
            material_.is_anchored({level.at(0, i), level.at(1, j), level.at(2, k)}))
          continue;
        for (std::size_t a = 0; a < 3; ++a) {
          const float sum = links[0] * spring_N_per_m_[0][a] + links[1] * spring_N_per_m_[1][a] +
                            links[2] * spring_N_per_m_[2][a];
          level.diagonal[a][n] = sum;
          level.inverse_diagonal[a][n] = 1.0F / sum;
        }
      }
    }
  }
}

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
                static_cast<std::uint32_t>(level.node(i + way[0], j + way[1], k + way[2])));
        }
        const auto count = static_cast<std::uint32_t>(level.ghost_neighbours.size()) - first;
        if (count > 0 && level.ghosts.size() < level.ghosts.capacity())
          level.ghosts.push_back({static_cast<std::uint32_t>(level.node(i, j, k)), first, count});
      }
    }
  }
}

void CompositeGrid::fill_ghosts(const Level& level, float* values) const noexcept {
  for (const Ghost& g : level.ghosts) {
    float sum = 0.0F;
    for (std::uint32_t n = g.first; n < g.first + g.count; ++n) sum += values[level.ghost_neighbours[n]];
    values[g.at] = sum / static_cast<float>(g.count);
  }
}

void CompositeGrid::distribute_ghost_loads(const Level& level, float* loads) const noexcept {
  for (const Ghost& g : level.ghosts) {
    const float share = loads[g.at] / static_cast<float>(g.count);
    loads[g.at] = 0.0F;
    if (share == 0.0F) continue;
    for (std::uint32_t n = g.first; n < g.first + g.count; ++n) loads[level.ghost_neighbours[n]] += share;
  }
}

}  // namespace voxel
