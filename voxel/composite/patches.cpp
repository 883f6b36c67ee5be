// SPDX-License-Identifier: GPL-3.0-or-later
// The boxes of a composite grid: which nodes there are, what holds them, and what they have of the next
// level.
#include <algorithm>
#include <cmath>

#include "voxel/composite/grid.h"

namespace voxel {
namespace {

constexpr std::size_t kFewGhosts = 16;  // times fewer of them has an object that fills its box
constexpr double kHeld = 0.25;          // of a side of the box
constexpr float kLeast = 1e-3F;         // of a whole link: what is worth less is none
constexpr float kAlmostAll = 0.999F;    // of one: through less of it there may be a gap
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

std::size_t index(int i) {
  return static_cast<std::size_t>(i);
}

// The multiple of `step` at or below.
int floored(int at, int step) {
  return at >= 0 ? at / step * step : -((-at + step - 1) / step) * step;
}

}  // namespace

void CompositeGrid::allocate(Level& level, std::size_t l) const {
  level.step = 1 << l;
  std::array<std::size_t, 3> most{};
  for (std::size_t d = 0; d < 3; ++d) {
    const int all = (cells_.high(d) - cells_.low(d)) / level.step + 3;
    const int half = half_width_of(l);
    most[d] = index(half == kRefineAll || l >= covering_level_ ? all : std::min(all, 2 * half + 2));
    level.line[d].coarse.resize(most[d]);
    // A row is read in octets.
    level.line[d].part.resize(most[d] + 16);
    level.line[d].along.resize(most[d] + 16);
    // By nodes of the next level, which may be all there are.
    const std::size_t next = most[d] + 4 * index(half_width_of(l + 1));
    for (auto* by_node : {&level.line[d].from_low, &level.line[d].from_own, &level.line[d].from_high})
      by_node->resize(next);
    level.line[d].fine.resize(next);
  }
  const std::size_t stride = (most[0] + 7) / 8 * 8, plane = stride * most[1];
  const std::size_t floats = plane * most[2] + 2 * (plane + stride + kPad) + 64;
  for (auto* arrays : {&level.u, &level.held, &level.weight, &level.hold, &level.inverse, &level.all}) {
    for (Floats& array : *arrays) array.assign(floats, 0.0F);
  }
  for (Floats* array : {&level.f, &level.old, &level.residual, &level.is_free, &level.is_active, &level.active_stiffness,
                        &level.inverse_with_active, &level.bound[0], &level.bound[1]})
    array->assign(floats, 0.0F);
  if (cells_.several()) {
    for (auto* arrays : {&level.tissue, &level.reach, &level.link[0], &level.link[1], &level.link[2],
                         &level.held_link[0], &level.held_link[1], &level.held_link[2]}) {
      for (Floats& array : *arrays) array.assign(floats, 0.0F);
    }
  }
  // Nodes beside the object, about as many as on its surface.
  const std::size_t share = cells_.fills_box() ? kFewGhosts : 1;
  level.ghosts.reserve(floats / (8 * share));
  level.beside.reserve(floats / share);
}

// Of before_move_: where the nodes of the largest box that moves were.
void CompositeGrid::allocate_for_moves() {
  std::size_t most = 0;
  for (std::size_t l = 0; l < covering_level_; ++l) {
    most = std::max(most, levels_[l].u[0].size());
    for (std::size_t d = 0; d < 3; ++d) {
      // As large as lines of any level, which are assigned to them.
      AxisNodes& line = before_move_.line[d];
      const AxisNodes& of = levels_[l].line[d];
      const auto grow = [](auto& room, const auto& like) { room.resize(std::max(room.size(), like.size())); };
      grow(line.coarse, of.coarse);
      grow(line.part, of.part);
      grow(line.along, of.along);
      grow(line.fine, of.fine);
      grow(line.from_low, of.from_low);
      grow(line.from_own, of.from_own);
      grow(line.from_high, of.from_high);
    }
  }
  for (auto* arrays : {&before_move_.u, &before_move_.held}) {
    for (Floats& axis : *arrays) axis.assign(most, 0.0F);
  }
  for (std::size_t a = 0; cells_.several() && a < 3; ++a) {
    for (auto* arrays : {&before_move_.link[a], &before_move_.held_link[a]}) {
      for (Floats& axis : *arrays) axis.assign(most, 0.0F);
    }
  }
}

// A node is where its cell has a part in the box of all voxels.
CompositeGrid::NodeRange CompositeGrid::node_range(std::size_t l, std::size_t d, int centre) const noexcept {
  const int step = levels_[l].step, half = half_width_of(l) * step;
  const int start = cells_.low(d), end = cells_.high(d);
  // Where something is anchored they go as far as that: what holds is found between two of them.
  NodeRange span{floored(cells_.anchored_part(d, 0) > kHeld ? start : start + step / 2, step),
            floored(end + (cells_.anchored_part(d, 1) > kHeld ? step - 1 : (step - 1) / 2), step), false,
            false};
  if (l >= covering_level_ || half < 0) return span;
  // Its sides are nodes of the next level.
  const int middle = floored(centre + step, 2 * step);
  span.open_low = middle - half > start;
  span.open_high = middle + half < end;
  if (span.open_low) span.low = middle - half;
  if (span.open_high) span.high = middle + half;
  return span;
}

void CompositeGrid::place_nodes(Level& level, std::size_t l, const Index3& centre) const noexcept {
  for (std::size_t d = 0; d < 3; ++d) {
    const NodeRange span = node_range(l, d, centre[d]);
    AxisNodes& line = level.line[d];
    line.open_low = span.open_low;
    line.open_high = span.open_high;
    line.begin = span.low;
    line.count = span.count(level.step);
    line.first = line.open_low ? 1 : 0;
    line.last = line.count - (line.open_high ? 2 : 1);
  }
  level.stride = index((level.line[0].count + 7) / 8 * 8);
  level.plane = level.stride * index(level.line[1].count);
}

void CompositeGrid::set_up_transfer(Level& fine, const Level& coarse) const noexcept {
  for (std::size_t d = 0; d < 3; ++d) {
    AxisNodes& line = fine.line[d];
    const AxisNodes& to = coarse.line[d];
    std::fill(line.part.begin(), line.part.end(), 0.0F);
    for (int i = 0; i < line.count; ++i) {
      const int away = fine.at(d, i) - to.begin;
      // Beyond its ends there is nothing to go by: as at the last node.
      const int before = std::clamp(floored(away, coarse.step) / coarse.step, 0, to.count - 1);
      line.coarse[index(i)] = before;
      const bool between = away > before * coarse.step && before + 1 < to.count;
      line.part[index(i)] = between ? 0.5F : 0.0F;
    }
    std::copy(line.part.begin(), line.part.end(), line.along.begin());
    const int way = fine.at(d, 0) - to.begin;
    line.base = floored(way, coarse.step) / coarse.step;
    line.odd = way != line.base * coarse.step;
    if (line.base < 0) line.along[0] = 1.0F;  // before the first there is none
    std::fill(line.fine.begin(), line.fine.end(), kOutside);
    line.coarse_first = to.count;
    line.coarse_last = -1;
    for (int c = 0; c < to.count; ++c) {
      const int at = coarse.at(d, c);
      int here = (at - line.begin) / fine.step;
      const bool below = at < line.begin, above = here >= line.count;
      if ((below && line.open_low) || (above && line.open_high)) continue;
      // One node may stand beyond the last of the finer level, its cell ending in the object.
      if (below) here = -1;
      if (above) here = line.count;
      const auto n = index(c);
      line.fine[n] = here;
      if (here < line.first && line.open_low) continue;
      if (here > line.last && line.open_high) continue;
      line.coarse_first = std::min(line.coarse_first, c);
      line.coarse_last = std::max(line.coarse_last, c);
      // What a fine node carries is shared as it is interpolated.
      const auto share = [&](int i) {
        if (i < line.first || i > line.last) return 0.0F;
        const float part = line.part[index(i)];
        return line.coarse[index(i)] == c ? 1.0F - part : line.coarse[index(i)] + 1 == c ? part : 0.0F;
      };
      line.from_low[n] = share(here - 1);
      line.from_own[n] = share(here);
      line.from_high[n] = share(here + 1);
    }
  }
}

void CompositeGrid::assemble(Level& level) noexcept {
  weigh(level);
  Index3 low{}, high{};
  for (std::size_t d = 0; d < 3; ++d) {
    low[d] = level.at(d, 0);
    high[d] = level.at(d, level.line[d].count - 1);
  }
  const bool near = cells_.anchor_near(low, high, 2 * level.step);
  find_anchor_weights(level, near);
  find_diagonal(level, near);
  find_ghosts(level);
}

// Links that a gap or an anchor breaks, and what anchors hold.
void CompositeGrid::find_anchor_weights(Level& level, bool near) noexcept {
  const auto& line = level.line;
  const int step = level.step;
  const auto whole = static_cast<float>(step);
  const bool several = cells_.several();
  level.broken = false;
  level.anchored_area = 0.0;
  level.holds = false;
  for (Floats& hold : level.hold) std::fill(hold.begin(), hold.end(), 0.0F);
  for (int k = 0; k < line[2].count; ++k) {
    for (int j = 0; j < line[1].count; ++j) {
      // Most rows are a full box's, far from anchors.
      const bool anchors_near = near && row_near_anchors(level, j, k);
      if (!anchors_near && cells_.fills_box()) continue;
      for (int i = 0; i < line[0].count; ++i) {
        const Index3 node{i, j, k}, at{level.at(0, i), level.at(1, j), level.at(2, k)};
        const std::size_t here = level.node(i, j, k);
        for (std::size_t d = 0; d < 3; ++d) {
          if (node[d] + 1 == line[d].count) continue;
          float& weight = level.weight[d][here];
          const float there = several ? level.tissue[d][here] : weight;
          if (there < kLeast * whole) {
            weight = 0.0F;
            level.broken = level.broken || !cells_.fills_box();
            continue;
          }
          Index3 after = at;
          after[d] += step;
          // From either end as far as the first anchor on the way, by what of the tissue is there.
          const float stiff = several ? weight / there : 1.0F;
          const CoarseMaterial::Anchored anchors =
              anchors_near ? cells_.anchors_along(at, d, step) : CoarseMaterial::Anchored{};
          const float part =
              anchors.links > 0 ? std::min(1.0F, there / static_cast<float>(anchors.links)) : 0.0F;
          const auto held = [&](int links) {
            return stiff * (part * whole * whole / static_cast<float>(links));
          };
          const std::size_t by = d == 0 ? 1 : d == 1 ? level.stride : level.plane;
          if (anchors.ahead > 0) level.hold[d][here] += held(anchors.ahead);
          if (anchors.back > 0) level.hold[d][here + by] += held(anchors.back);
          if (several && anchors.ahead > 0) level.reach[d][here] = static_cast<float>(anchors.ahead);
          if (several && anchors.back > 0) level.reach[d][here + by] = static_cast<float>(-anchors.back);
          const int ends = (anchors.low_free && anchors.ahead > 0 ? 1 : 0) +
                           (anchors.high_free && anchors.back > 0 ? 1 : 0);
          level.anchored_area += ends * static_cast<double>(part * whole * whole);
          const bool gap = step > 1 && there < kAlmostAll * whole && cells_.filled(at) &&
                           cells_.filled(after) && !cells_.unbroken(at, d, step);
          if (anchors.ahead == 0 && anchors.back == 0 && !gap) continue;
          weight = 0.0F;
          level.holds = level.holds || !gap || anchors.ahead > 0 || anchors.back > 0;
          level.broken = level.broken || gap;
        }
      }
    }
  }
}

bool CompositeGrid::row_near_anchors(const Level& level, int j, int k) const noexcept {
  Index3 from{level.at(0, 0), level.at(1, j), level.at(2, k)}, to = from;
  to[0] = level.at(0, level.line[0].count - 1);
  return cells_.anchor_near(from, to, 2 * level.step);
}

// What all links of a node are worth; nothing where it may not move.
void CompositeGrid::find_diagonal(Level& level, bool near) noexcept {
  const auto& line = level.line;
  const std::size_t by_y = level.stride, by_z = level.plane;
  for (std::size_t a = 0; a < 3; ++a) {
    std::fill(level.inverse[a].begin(), level.inverse[a].end(), 0.0F);
    std::fill(level.all[a].begin(), level.all[a].end(), 0.0F);
  }
  for (int k = line[2].first; k <= line[2].last; ++k) {
    for (int j = line[1].first; j <= line[1].last; ++j) {
      const bool anchors_near = near && row_near_anchors(level, j, k);
      if (!anchors_near && cells_.fills_box()) {
        const std::size_t row = level.row(j, k);
        const float *const x = level.weight[0].data() + row, *const y = level.weight[1].data() + row,
                           *const z = level.weight[2].data() + row;
        for (std::size_t a = 0; a < 3; ++a) {
          float *const all = level.all[a].data() + row, *const inverse = level.inverse[a].data() + row;
          const float sx = spring_N_per_m_[0][a], sy = spring_N_per_m_[1][a], sz = spring_N_per_m_[2][a];
          for (std::ptrdiff_t i = line[0].first; i <= line[0].last; ++i) {
            all[i] = sx * (x[i] + x[i - 1]) + sy * (y[i] + y[i - static_cast<std::ptrdiff_t>(by_y)]) +
                     sz * (z[i] + z[i - static_cast<std::ptrdiff_t>(by_z)]);
            inverse[i] = all[i] > 0.0F ? 1.0F / all[i] : 0.0F;
          }
        }
        continue;
      }
      for (int i = line[0].first; i <= line[0].last; ++i) {
        const std::size_t n = level.node(i, j, k);
        const std::array<float, 3> links{level.weight[0][n] + level.weight[0][n - 1] + level.hold[0][n],
                                         level.weight[1][n] + level.weight[1][n - by_y] + level.hold[1][n],
                                         level.weight[2][n] + level.weight[2][n - by_z] + level.hold[2][n]};
        if (links[0] + links[1] + links[2] == 0.0F) continue;
        if (anchors_near && cells_.anchored({level.at(0, i), level.at(1, j), level.at(2, k)})) continue;
        for (std::size_t a = 0; a < 3; ++a) {
          const float sum = links[0] * spring_N_per_m_[0][a] + links[1] * spring_N_per_m_[1][a] + links[2] * spring_N_per_m_[2][a];
          level.all[a][n] = sum;
          level.inverse[a][n] = 1.0F / sum;
        }
      }
    }
  }
}

// Nodes that are none, beside some that are: what finer levels interpolate between these and those.
void CompositeGrid::find_ghosts(Level& level) noexcept {
  const auto& line = level.line;
  level.ghosts.clear();
  level.beside.clear();
  const auto is_node = [&](int i, int j, int k) {
    const std::size_t n = level.node(i, j, k);
    if (level.inverse[0][n] != 0.0F) return true;
    for (std::size_t d = 0; d < 3; ++d) {
      const std::size_t by = d == 0 ? 1 : d == 1 ? level.stride : level.plane;
      if (level.weight[d][n] != 0.0F || level.weight[d][n - by] != 0.0F || level.hold[d][n] != 0.0F)
        return true;
    }
    return cells_.anchored({level.at(0, i), level.at(1, j), level.at(2, k)});
  };
  for (int k = 0; k < line[2].count; ++k) {
    for (int j = 0; j < line[1].count; ++j) {
      for (int i = 0; i < line[0].count; ++i) {
        if (is_node(i, j, k)) continue;
        const auto first = static_cast<std::uint32_t>(level.beside.size());
        for (const auto& way : kAround) {
          const int x = i + way[0], y = j + way[1], z = k + way[2];
          if (x < 0 || y < 0 || z < 0 || x >= line[0].count || y >= line[1].count || z >= line[2].count)
            continue;
          if (is_node(x, y, z) && level.beside.size() < level.beside.capacity())
            level.beside.push_back(static_cast<std::uint32_t>(level.node(x, y, z)));
        }
        const auto count = static_cast<std::uint32_t>(level.beside.size()) - first;
        if (count > 0 && level.ghosts.size() < level.ghosts.capacity())
          level.ghosts.push_back({static_cast<std::uint32_t>(level.node(i, j, k)), first, count});
      }
    }
  }
}

void CompositeGrid::spread_to_ghosts(const Level& level, float* values) const noexcept {
  for (const Ghost& g : level.ghosts) {
    float sum = 0.0F;
    for (std::uint32_t n = g.first; n < g.first + g.count; ++n) sum += values[level.beside[n]];
    values[g.at] = sum / static_cast<float>(g.count);
  }
}

void CompositeGrid::gather_from_ghosts(const Level& level, float* loads) const noexcept {
  for (const Ghost& g : level.ghosts) {
    const float share = loads[g.at] / static_cast<float>(g.count);
    loads[g.at] = 0.0F;
    if (share == 0.0F) continue;
    for (std::uint32_t n = g.first; n < g.first + g.count; ++n) loads[level.beside[n]] += share;
  }
}

}  // namespace voxel
