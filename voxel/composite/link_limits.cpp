// SPDX-License-Identifier: GPL-3.0-or-later
// Multipliers of links at their limits, where bounds of nodes do not suffice.
//
// In a body of one tissue bounds suffice (grid.h). But with bounds alone, a soft tissue between stiffer ones
// would be compressed beyond its limits. So where tissues differ, each link at its limit also carries a
// reaction: the multiplier of the limit. The multiplier is stored as additional stiffness. After each cycle,
// links beyond their limit become stiffer. Links within their limit become softer again, but never softer
// than their spring. The equilibrium is then the optimum within the limits: a reaction acts along its link,
// only at the limit, and only against its violation. Cycles need no change, because a level knows its links
// by their weights alone. The energy of the springs does not count multipliers.
#include <algorithm>

#include "voxel/composite/grid.h"
#include "voxel/composite/row_kernels.h"

namespace voxel {
namespace {

using composite::index;

// Upper bound of a link's weight with its multiplier (unit: weight of the link without multiplier).
constexpr float kMaxFactor = 1e3F;
// Links whose change of length is within this share of their limit count as being at the limit.
constexpr float kTolerance = 2e-3F;

}  // namespace

composite::LimitOfLinks CompositeGrid::limit_of_links(const Level& level, std::size_t a, std::size_t d,
                                                      std::size_t side) const noexcept {
  const auto step = static_cast<float>(level.step);
  composite::LimitOfLinks limit{step * limit_m_[d][a][side].widest, nullptr, 0.0F};
  if (!material_.has_own_limits()) return limit;
  limit.at_node = level.limit[d == a ? side : 2].data() + level.first_row();
  limit.half_length_m = 0.5F * step * static_cast<float>(lattice_.spacing_m()[static_cast<int>(d)]);
  return limit;
}

composite::LinkMultiplier CompositeGrid::link_multiplier(const Level& level, std::size_t a,
                                                         std::size_t d) const noexcept {
  return {limit_of_links(level, a, d, 1), limit_of_links(level, a, d, 0), kTolerance, kMaxFactor};
}

// Call it after a cycle on axis `a`.
void CompositeGrid::update_multipliers(std::size_t a) noexcept {
  if (!material_.is_heterogeneous()) return;
  if (!multipliers_active_[a]) {
    float most = 0.0F;
    for (std::size_t l = 0; l <= covering_level_; ++l) {
      const Level& level = levels_[l];
      const std::size_t from = level.first_row();
      for (std::size_t d = 0; d < 3; ++d) {
        most = std::max(most, composite::largest_limit_ratio(
                                  level.u[a].data() + from, level.weight[d].data() + from,
                                  level.stride_along(d), link_multiplier(level, a, d), level.floats()));
        most = std::max(most, largest_anchor_ratio(level, a, d));
      }
    }
    if (most <= 1.0F + kTolerance) return;
    multipliers_active_[a] = true;
    for (Level& level : levels_) {
      for (std::size_t d = 0; d < 3; ++d) {
        std::copy(level.weight[d].begin(), level.weight[d].end(), level.limited_weight[a][d].begin());
        std::copy(level.anchor_weight[d].begin(), level.anchor_weight[d].end(),
                  level.limited_anchor_weight[a][d].begin());
      }
    }
  }
  float most = 0.0F;
  for (std::size_t l = 0; l <= covering_level_; ++l) {
    Level& level = levels_[l];
    const std::size_t from = level.first_row();
    for (std::size_t d = 0; d < 3; ++d) {
      const composite::LinkMultiplier limit = link_multiplier(level, a, d);
      most =
          std::max(most, composite::update_row_weights(
                             level.u[a].data() + from, level.weight[d].data() + from, level.stride_along(d),
                             limit, level.limited_weight[a][d].data() + from, level.floats()));
      most = std::max(most, update_anchor_multipliers(level, a, d));
    }
    drop_multipliers_at_sides(level, a);
  }
  if (most > 1.0F) {
    for (std::size_t l = 1; l < levels_.size(); ++l) restrict_multipliers(l, a);
  } else {
    multipliers_active_[a] = false;
  }
  for (Level& level : levels_) update_diagonal(level, a);
}

// Nodes in the sides of a patch within the object hold displacements interpolated from the next level. These
// may exceed the limits of single links. So links of such nodes have no multipliers. The links of the next
// level have them.
void CompositeGrid::drop_multipliers_at_sides(Level& level, std::size_t a) noexcept {
  const auto& nodes = level.nodes;
  for (std::size_t e = 0; e < 3; ++e) {
    for (const bool high : {false, true}) {
      if (!(high ? nodes[e].open_high : nodes[e].open_low)) continue;
      const std::size_t p = (e + 1) % 3, q = (e + 2) % 3;
      Index3 node{};
      node[e] = high ? nodes[e].count - 1 : 0;
      const auto drop = [&](std::size_t d, std::size_t n) {
        level.limited_weight[a][d][n] = level.weight[d][n];
      };
      for (node[q] = 0; node[q] < nodes[q].count; ++node[q]) {
        for (node[p] = 0; node[p] < nodes[p].count; ++node[p]) {
          const std::size_t n = level.node(node[0], node[1], node[2]);
          drop(p, n);
          drop(q, n);
          drop(e, high ? n - level.stride_along(e) : n);
        }
      }
    }
  }
}

// Updates the multipliers of the links to anchors, as update_row_weights() does for links between nodes.
// Returns the largest limited / weight, >= 1.
float CompositeGrid::update_anchor_multipliers(Level& level, std::size_t a, std::size_t d) noexcept {
  float most = 1.0F;
  const composite::LinkMultiplier links = link_multiplier(level, a, d);
  const auto& weight = level.anchor_weight[d];
  auto& limited = level.limited_anchor_weight[a][d];
  for_anchor_ratios(level, a, d, [&](std::size_t n, float ratio) {
    limited[n] = composite::updated_weight(limited[n], weight[n], ratio, links);
    most = std::max(most, limited[n] / weight[n]);
  });
  return most;
}

// Calls visit(node, ratio) for the nodes with an anchor along d. Ratio: extension of the chain to the anchor
// over its limit.
template <class Visit>
void CompositeGrid::for_anchor_ratios(const Level& level, std::size_t a, std::size_t d,
                                      const Visit& visit) const {
  if (!level.has_anchors) return;
  const std::size_t from = level.first_row(), end = from + level.floats();
  const composite::LimitOfLinks longest = limit_of_links(level, a, d, 1),
                                shortest = limit_of_links(level, a, d, 0);
  const float *const weight = level.anchor_weight[d].data(), *const distance =
                                                                 level.anchor_distance[d].data();
  const float* const u = level.u[a].data();
  for (std::size_t n = from; n < end; ++n) {
    if (weight[n] == 0.0F) continue;
    // The chain's extension is −u if the anchor is ahead, u if it is behind. The limits are those of a link
    // as long as the level's step, but the chain is `distance` voxels long.
    const float longer = -u[n] * static_cast<float>(level.step) / distance[n];
    visit(n, std::max(longer / composite::limit_at(longest, n - from, 0),
                      -longer / composite::limit_at(shortest, n - from, 0)));
  }
}

float CompositeGrid::largest_anchor_ratio(const Level& level, std::size_t a, std::size_t d) const {
  float most = 0.0F;
  for_anchor_ratios(level, a, d, [&](std::size_t, float ratio) { most = std::max(most, ratio); });
  return most;
}

// Within the finer patch, multipliers stiffen a link by the same factor as its two fine links in series.
void CompositeGrid::restrict_multipliers(std::size_t l, std::size_t a) noexcept {
  const Level& fine = levels_[l - 1];
  Level& coarse = levels_[l];
  const auto& nodes = fine.nodes;
  const auto within = [&](std::size_t d, int c) {
    const int here = nodes[d].fine[index(c)];
    return here >= 0 && here < nodes[d].count;
  };
  for (int k = nodes[2].coarse_first; k <= nodes[2].coarse_last; ++k) {
    for (int j = nodes[1].coarse_first; j <= nodes[1].coarse_last; ++j) {
      for (int i = nodes[0].coarse_first; i <= nodes[0].coarse_last; ++i) {
        const Index3 c{i, j, k};
        if (!within(0, i) || !within(1, j) || !within(2, k)) continue;
        const std::size_t at =
            fine.node(nodes[0].fine[index(i)], nodes[1].fine[index(j)], nodes[2].fine[index(k)]);
        const std::size_t here = coarse.node(i, j, k);
        for (std::size_t d = 0; d < 3; ++d) {
          if (nodes[d].fine[index(c[d])] + 2 >= nodes[d].count) continue;
          const std::size_t next = at + fine.stride_along(d);
          const float one = fine.weight[d][at], other = fine.weight[d][next];
          const float one_limited = fine.limited_weight[a][d][at],
                      other_limited = fine.limited_weight[a][d][next];
          if (one <= 0.0F || other <= 0.0F) continue;
          const float stiffer = (1.0F / one + 1.0F / other) / (1.0F / one_limited + 1.0F / other_limited);
          coarse.limited_weight[a][d][here] = stiffer * coarse.weight[d][here];
        }
      }
    }
  }
}

// Finds the diagonal and its inverse from the weights that now apply on axis `a`.
void CompositeGrid::update_diagonal(Level& level, std::size_t a) const noexcept {
  const auto& nodes = level.nodes;
  const auto& weight = weights_on(level, a);
  const auto& anchor_weight = anchor_weights_on(level, a);
  const float sx = spring_N_per_m_[0][a], sy = spring_N_per_m_[1][a], sz = spring_N_per_m_[2][a];
  for (int k = nodes[2].first; k <= nodes[2].last; ++k) {
    for (int j = nodes[1].first; j <= nodes[1].last; ++j) {
      const std::size_t row = level.row(j, k);
      const float *const x = weight[0].data() + row, *const y = weight[1].data() + row,
                         *const z = weight[2].data() + row;
      const float *const back_x = x - 1, *const back_y = y - level.stride, *const back_z = z - level.plane;
      const float *const hx = anchor_weight[0].data() + row, *const hy = anchor_weight[1].data() + row,
                         *const hz = anchor_weight[2].data() + row;
      float *const all = level.diagonal[a].data() + row, *const inverse =
                                                             level.inverse_diagonal[a].data() + row;
      for (int i = nodes[0].first; i <= nodes[0].last; ++i) {
        const float sum = sx * (x[i] + back_x[i] + hx[i]) + sy * (y[i] + back_y[i] + hy[i]) +
                          sz * (z[i] + back_z[i] + hz[i]);
        const bool moves = inverse[i] > 0.0F;
        all[i] = moves ? sum : all[i];
        inverse[i] = moves ? 1.0F / sum : 0.0F;
      }
    }
  }
}

// Drops all multipliers when a contact ends.
void CompositeGrid::release_multipliers() noexcept {
  for (std::size_t a = 0; a < 3; ++a) {
    if (!multipliers_active_[a]) continue;
    multipliers_active_[a] = false;
    for (Level& level : levels_) update_diagonal(level, a);
  }
}

// Saves into before_move_ the factors by which multipliers stiffen a level's links.
void CompositeGrid::save_multipliers(const Level& level) noexcept {
  for (std::size_t a = 0; a < 3; ++a) {
    if (!multipliers_active_[a]) continue;
    for (std::size_t d = 0; d < 3; ++d) {
      const auto save = [](const Floats& limited, const Floats& weight, Floats& to) {
        for (std::size_t n = 0; n < limited.size(); ++n)
          to[n] = weight[n] > 0.0F ? limited[n] / weight[n] : 1.0F;
      };
      save(level.limited_weight[a][d], level.weight[d], before_move_.limited_weight[a][d]);
      save(level.limited_anchor_weight[a][d], level.anchor_weight[d],
           before_move_.limited_anchor_weight[a][d]);
    }
  }
}

// Restores the saved factors in the patch at its new place, `by` nodes further on.
void CompositeGrid::restore_multipliers(Level& level, const Index3& by) noexcept {
  const auto& nodes = level.nodes;
  for (std::size_t a = 0; a < 3; ++a) {
    if (!multipliers_active_[a]) continue;
    for (std::size_t d = 0; d < 3; ++d) {
      std::copy(level.weight[d].begin(), level.weight[d].end(), level.limited_weight[a][d].begin());
      std::copy(level.anchor_weight[d].begin(), level.anchor_weight[d].end(),
                level.limited_anchor_weight[a][d].begin());
    }
    for (int k = 0; k < nodes[2].count; ++k) {
      for (int j = 0; j < nodes[1].count; ++j) {
        for (int i = 0; i < nodes[0].count; ++i) {
          const Index3 was{i + by[0], j + by[1], k + by[2]};
          bool known = true;
          for (std::size_t d = 0; d < 3; ++d)
            known = known && was[d] >= 0 && was[d] < before_move_.nodes[d].count;
          if (!known) continue;
          const std::size_t to = level.node(i, j, k), from = before_move_.node(was[0], was[1], was[2]);
          for (std::size_t d = 0; d < 3; ++d) {
            level.limited_weight[a][d][to] *= before_move_.limited_weight[a][d][from];
            level.limited_anchor_weight[a][d][to] *= before_move_.limited_anchor_weight[a][d][from];
          }
        }
      }
    }
    update_diagonal(level, a);
  }
}

}  // namespace voxel
