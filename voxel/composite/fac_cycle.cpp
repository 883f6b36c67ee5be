// SPDX-License-Identifier: GPL-3.0-or-later
// One FAC cycle over the levels of a CompositeGrid, axis by axis, in the full approximation scheme (FAS):
// restriction down to the coarsest level, then correction and smoothing level by level up to the finest.
// Where a finer patch covers a level, the level takes the finer displacements by injection. There its load f
// makes its residual equal to the restricted residual of the finer level. Elsewhere its nodes are unknowns,
// and f holds the loads of rigid surfaces and of the accurate energy.
#include <algorithm>

#include "voxel/composite/grid.h"
#include "voxel/composite/row_kernels.h"
#include "voxel/composite/transfer.h"

namespace voxel {
namespace {

using composite::index;

constexpr int kCoarsestSweeps = 10;  // sweeps that solve the coarsest level, which has few nodes
constexpr std::size_t kMaxAcross = std::size_t{composite::kMaxVectors} * kLanes;  // nodes of a row, at most

}  // namespace

composite::LevelView CompositeGrid::view(std::size_t l, std::size_t axis) noexcept {
  Level& level = levels_[l];
  const std::size_t from = level.first_row();
  composite::LevelView v{};
  v.u = level.u[axis].data() + from;
  v.f = l == 0 && obstacle_bounds_.empty() && !has_bricks_ ? nullptr : level.f.data() + from;
  v.lower = level.bounded[0] ? level.bound[0].data() + from : nullptr;
  v.negated_upper = level.bounded[1] ? level.bound[1].data() + from : nullptr;
  v.residual = level.residual.data() + from;
  v.is_free = level.is_free.data() + from;
  v.is_active = level.is_active.data() + from;
  v.active_stiffness = level.active_stiffness.data() + from;
  v.inverse_with_active = level.has_active_stiffness ? level.inverse_with_active.data() + from : nullptr;
  for (std::size_t d = 0; d < 3; ++d) {
    v.weight[d] = weights_on(level, axis)[d].data() + from;
    v.spring[d] = spring_N_per_m_[d][axis];
    v.first[d] = level.nodes[d].first;
    v.last[d] = level.nodes[d].last;
  }
  v.inverse_diagonal = level.inverse_diagonal[axis].data() + from;
  v.diagonal = level.diagonal[axis].data() + from;
  v.stride = level.stride;
  v.plane = level.plane;
  return v;
}

// Injects the finer level's displacements into the nodes it covers.
void CompositeGrid::inject_from_finer(std::size_t l, std::size_t a) noexcept {
  const Level& fine = levels_[l - 1];
  Level& coarse = levels_[l];
  const auto& nodes = fine.nodes;
  // A coarse node beyond the last node of the finer level takes that node's value.
  const auto nearest = [&](std::size_t d, int c) {
    return index(std::clamp(nodes[d].fine[index(c)], 0, nodes[d].count - 1));
  };
  for (int k = nodes[2].coarse_first; k <= nodes[2].coarse_last; ++k) {
    for (int j = nodes[1].coarse_first; j <= nodes[1].coarse_last; ++j) {
      const float* from =
          fine.u[a].data() + fine.row(static_cast<int>(nearest(1, j)), static_cast<int>(nearest(2, k)));
      float* to = coarse.u[a].data() + coarse.row(j, k);
      for (int i = nodes[0].coarse_first; i <= nodes[0].coarse_last; ++i) to[i] = from[nearest(0, i)];
    }
  }
  fill_ghosts(coarse, coarse.u[a].data());
}

// f = loads of the accurate energy, or 0.
void CompositeGrid::put_loads(std::size_t l, std::size_t a) noexcept {
  Level& level = levels_[l];
  const auto from = static_cast<std::ptrdiff_t>(level.first_row());
  if (has_bricks_ && l <= covering_level_) {
    std::copy_n(level.brick_load[a].begin() + from, level.floats(), level.f.begin() + from);
  } else {
    std::fill_n(level.f.begin() + from, level.floats(), 0.0F);
  }
}

// FAS restriction from level l to l + 1: f = R(residual) + K u at the injected u, on the nodes under level l.
void CompositeGrid::restrict_residual(std::size_t l, std::size_t a) noexcept {
  Level& fine = levels_[l];
  Level& coarse = levels_[l + 1];
  const auto& nodes = fine.nodes;
  Index3 first{}, last{};
  for (std::size_t d = 0; d < 3; ++d) {
    first[d] = nodes[d].coarse_first;
    last[d] = nodes[d].coarse_last;
  }
  const composite::LevelView here = view(l, a);
  composite::residual_of_level(here);
  // Coarser levels do not know which nodes are active, so they get the stiffness of the links to active
  // nodes.
  const bool any_active =
      fine.bounded[0] || fine.bounded[1] || fine.has_active_stiffness || !coarse.correction_springs.empty();
  if (any_active) {
    if (!fine.has_active_stiffness)
      std::fill(fine.active_stiffness.begin(), fine.active_stiffness.end(), 0.0F);
    add_active_stiffness(l, a);
    composite::find_active_stiffness(here);
  }
  inject_from_finer(l + 1, a);
  const std::size_t begin = coarse.first_row(), floats = coarse.floats();
  put_loads(l + 1, a);
  composite::link_forces_of_level(view(l + 1, a), first, last);
  restrict_values(coarse, fine, a, fine.residual.data(), coarse.f.data());
  for (int k = first[2]; k <= last[2]; ++k) {
    for (int j = first[1]; j <= last[1]; ++j) {
      float* f = coarse.f.data() + coarse.row(j, k);
      const float* forces = coarse.residual.data() + coarse.row(j, k);
      for (int i = first[0]; i <= last[0]; ++i) f[i] -= forces[i];
    }
  }
  add_obstacle_loads(l + 1, a);
  coarse.has_active_stiffness = any_active;
  if (any_active) {
    std::fill_n(coarse.active_stiffness.begin() + static_cast<std::ptrdiff_t>(begin), floats, 0.0F);
    restrict_values(coarse, fine, a, fine.active_stiffness.data(), coarse.active_stiffness.data());
    for (const CorrectionSpring& s : coarse.correction_springs) {
      coarse.active_stiffness[s.node] += s.weight[0] * spring_N_per_m_[0][a] +
                                         s.weight[1] * spring_N_per_m_[1][a] +
                                         s.weight[2] * spring_N_per_m_[2][a];
    }
  }
  std::copy_n(coarse.u[a].begin() + static_cast<std::ptrdiff_t>(begin), floats,
              coarse.restricted_u.begin() + static_cast<std::ptrdiff_t>(begin));
}

// Restricts loads or stiffness from the nodes of `fine` to those of `coarse`, with the transposed
// prolongation.
void CompositeGrid::restrict_values(Level& coarse, const Level& fine, std::size_t axis, const float* from,
                                    float* to) const noexcept {
  if (material_.is_heterogeneous()) return restrict_by_links(coarse, fine, axis, from, to);
  const auto& nodes = fine.nodes;
  Index3 first{}, last{};
  for (std::size_t d = 0; d < 3; ++d) {
    first[d] = nodes[d].coarse_first;
    last[d] = nodes[d].coarse_last;
  }
  for (int k = first[2]; k <= last[2]; ++k) {
    const int fk = nodes[2].fine[index(k)];
    const std::array<float, 3> wk{nodes[2].restrict_low[index(k)], nodes[2].restrict_own[index(k)],
                                  nodes[2].restrict_high[index(k)]};
    for (int j = first[1]; j <= last[1]; ++j) {
      const int fj = nodes[1].fine[index(j)];
      const std::array<float, 3> wj{nodes[1].restrict_low[index(j)], nodes[1].restrict_own[index(j)],
                                    nodes[1].restrict_high[index(j)]};
      std::array<float, kMaxAcross + 2> sum;
      const std::size_t lanes = fine.stride;
      std::fill_n(sum.begin(), lanes + 3, 0.0F);
      for (int dk = -1; dk <= 1; ++dk) {
        for (int dj = -1; dj <= 1; ++dj) {
          const float w = wk[index(dk + 1)] * wj[index(dj + 1)];
          if (w == 0.0F) continue;
          const float* row = from + fine.row(fj + dj, fk + dk);
          for (std::size_t i = 0; i < lanes; ++i) sum[i + 1] += w * row[i];
        }
      }
      float* f = to + coarse.row(j, k);
      for (int i = first[0]; i <= last[0]; ++i) {
        const int at = nodes[0].fine[index(i)] + 1;  // sum[0]: the lane before the first
        float all = nodes[0].restrict_own[index(i)] * sum[index(at)] +
                    nodes[0].restrict_high[index(i)] * sum[index(at + 1)];
        if (at > 0) all += nodes[0].restrict_low[index(i)] * sum[index(at - 1)];
        f[i] = all;
      }
    }
  }
  distribute_ghost_loads(coarse, to);
}

// Adds springs for active nodes of finer levels. Active nodes take no corrections, and they hold the free
// nodes linked to them. Without these springs a coarse level would not know of this resistance: it would move
// a whole contact if none of its own nodes is in the contact.
void CompositeGrid::add_active_stiffness(std::size_t l, std::size_t a) noexcept {
  Level& level = levels_[l];
  if (!level.has_active_stiffness) return;
  composite::add_active_stiffness(view(l, a), level.f.data() + level.first_row());
}

// Prolongs `from`, an array of the coarse level, to row (j, k) of the fine level.
void CompositeGrid::prolong_row(Level& fine, const Level& coarse, std::size_t axis, const float* from, int j,
                                int k, bool adds) const noexcept {
  const auto& nodes = fine.nodes;
  composite::ProlongArgs t{};
  const std::size_t row = fine.row(j, k);
  t.odd = nodes[0].odd;
  t.lane_weight = nodes[0].lane_weight.data();
  t.lower = fine.bounded[0] ? fine.bound[0].data() + row : nullptr;
  t.negated_upper = fine.bounded[1] ? fine.bound[1].data() + row : nullptr;
  t.is_free = fine.is_free.data() + row;
  t.u = fine.u[axis].data() + row;
  t.vectors = static_cast<int>(fine.stride / 8);
  t.adds = adds;
  if (material_.is_heterogeneous()) return prolong_row_by_links(t, fine, coarse, axis, from, j, k);
  for (int corner = 0; corner < 4; ++corner) {
    const int dj = corner & 1, dk = corner >> 1;
    const float pj = nodes[1].weight_after[index(j)], pk = nodes[2].weight_after[index(k)];
    const float w = (dj != 0 ? pj : 1.0F - pj) * (dk != 0 ? pk : 1.0F - pk);
    if (w == 0.0F) continue;
    t.weights[index(t.count)] = w;
    t.rows[index(t.count++)] =
        from + coarse.row(nodes[1].coarse[index(j)] + dj, nodes[2].coarse[index(k)] + dk) + nodes[0].base;
  }
  composite::prolong_row(t);
}

// Adds the prolonged correction of level l + 1 to level l. Nodes on the patch's sides within the object get
// the prolonged displacement itself, as a Dirichlet boundary condition.
void CompositeGrid::prolong(std::size_t l, std::size_t a) noexcept {
  Level& fine = levels_[l];
  Level& coarse = levels_[l + 1];
  const auto& nodes = fine.nodes;
  fill_ghosts(coarse, coarse.u[a].data());
  float* const correction = coarse.restricted_u.data();
  const float* const now = coarse.u[a].data();
  const std::size_t begin = coarse.first_row(), end = begin + coarse.floats();
  for (std::size_t n = begin; n < end; ++n) correction[n] = now[n] - correction[n];
  for (int k = 0; k < nodes[2].count; ++k) {
    const bool side_k = k < nodes[2].first || k > nodes[2].last;
    for (int j = 0; j < nodes[1].count; ++j) {
      const bool side = side_k || j < nodes[1].first || j > nodes[1].last;
      prolong_row(fine, coarse, a, side ? now : correction, j, k, !side);
      for (const bool high : {false, true}) {
        if (side || !(high ? nodes[0].open_high : nodes[0].open_low)) continue;
        const int i = high ? nodes[0].count - 1 : 0;
        // Prolonged displacement of the side node at this end of the row.
        const auto interpolated = [&] {
          if (material_.is_heterogeneous()) return prolonged_by_links(fine, coarse, a, now, i, j, k);
          const float pj = nodes[1].weight_after[index(j)], pk = nodes[2].weight_after[index(k)];
          const std::size_t at =
              coarse.node(nodes[0].coarse[index(i)], nodes[1].coarse[index(j)], nodes[2].coarse[index(k)]);
          const std::size_t by_j = pj != 0.0F ? coarse.stride : 0, by_k = pk != 0.0F ? coarse.plane : 0;
          return (1.0F - pk) * ((1.0F - pj) * now[at] + pj * now[at + by_j]) +
                 pk * ((1.0F - pj) * now[at + by_k] + pj * now[at + by_j + by_k]);
        };
        float u = interpolated();
        const std::size_t here = fine.node(i, j, k);
        if (fine.bounded[0]) u = std::max(u, fine.bound[0][here]);
        if (fine.bounded[1]) u = std::min(u, -fine.bound[1][here]);
        fine.u[a][here] = u;
      }
    }
  }
}

void CompositeGrid::cycle(const std::array<bool, 3>& axes) noexcept {
  work_ = 0;
  const std::size_t last = levels_.size() - 1;
  for (std::size_t a = 0; a < 3; ++a) {
    if (!axes[a]) continue;
    renew_brick_loads();
    find_bounds(a);
    add_obstacle_bounds(a);
    const auto bound = [](Level& level, std::size_t kind) {
      return level.bounded[kind] ? level.bound[kind].data() + level.first_row() : nullptr;
    };
    for (Level& level : levels_) {
      if (!level.bounded[0] && !level.bounded[1]) continue;
      composite::follow_bounds(level.u[a].data() + level.first_row(),
                               level.at_bound[a].data() + level.first_row(), bound(level, 0), bound(level, 1),
                               recedes_m_, level.floats());
    }
    const auto smooth = [this, a](std::size_t l) {
      composite::smooth_level(view(l, a));
      work_ += levels_[l].floats() / 8;
    };
    // No level is smoothed before restriction. Otherwise, after a jump of the tool, a fine level would follow
    // its bounds before the coarse levels do, and would pull them too far.
    levels_[0].has_active_stiffness = false;
    put_loads(0, a);
    add_obstacle_loads(0, a);
    for (std::size_t l = 0; l < last; ++l) restrict_residual(l, a);
    add_active_stiffness(last, a);
    for (int n = 0; n < kCoarsestSweeps; ++n) smooth(last);
    for (std::size_t l = last; l-- > 0;) {
      // With links at their limits a correction may raise the energy, and cycles would diverge. So the
      // correction is shortened.
      if (multipliers_active_[a]) {
        Level& level = levels_[l];
        std::copy(level.u[a].begin(), level.u[a].end(), level.residual.begin());
        prolong(l, a);
        composite::shorten_correction(view(l, a), level.residual.data() + level.first_row());
      } else {
        prolong(l, a);
      }
      smooth(l);
      // The two finest levels, where the contact is, are smoothed twice: with one sweep the active set may
      // alternate.
      if (l <= 1) smooth(l);
    }
    for (Level& level : levels_) {
      composite::note_at_bound(level.at_bound[a].data() + level.first_row(),
                               level.u[a].data() + level.first_row(), bound(level, 0), bound(level, 1),
                               level.floats());
    }
    fill_ghosts(levels_[0], levels_[0].u[a].data());
    fit_far_field(a);
    measure_obstacle_forces(a);
    measure_pressing_force(a);
    update_multipliers(a);
  }
  patch_moved_ = false;
}

}  // namespace voxel
