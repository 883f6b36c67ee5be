// SPDX-License-Identifier: GPL-3.0-or-later
// Smoothing and restriction; the frozen residual of rows.
#include <algorithm>

#include "voxel/lattice/prefetch.h"
#include "voxel/multigrid/fas.h"

namespace voxel {

LevelRow Multigrid::row_of(int level, RowId row, Displacement& state) noexcept {
  Level& l = at(level);
  const Grid& g = l.couplings->grid();
  const std::size_t begin = static_cast<std::size_t>(row) * kRow;
  LevelRow r;
  l.couplings->all(row, r.springs);
  r.z = static_cast<std::ptrdiff_t>(g.row_z) * kRow;
  r.x = static_cast<std::ptrdiff_t>(g.row_x) * kRow;
  if (level == 0) {
    const float* const balanced = frozen_load(row, 0);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      r.u[axis] = state.u[axis].data() + begin;
      r.load[axis] =
          balanced != nullptr ? balanced + axis * kRow : state.load_of(row, static_cast<int>(axis));
    }
    if (state.row_standing[row] != 0) r.held = state.role.data() + begin;
    return r;
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    r.u[axis] = l.value[axis].data() + begin;
    r.load[axis] = l.load[axis].data() + begin;
    r.held_at[axis] = l.loaded_at[axis].data() + begin;
  }
  if (boundary_springs_->any(level, row)) {
    for (std::size_t axis = 0; axis < 3; ++axis) r.hold[axis] = boundary_springs_->hold(level, row, axis);
  }
  r.hold_times = boundary_scale_;
  if (has(level, row, limited)) r.stopped = l.stopped.data() + begin;
  return r;
}

bool Multigrid::update_plasticity(RowId row, Displacement& state, bool keep) noexcept {
  if (state.plastic.row[row] == 0) {
    bool beyond = false;
    for (int axis = 0; axis < 3 && !beyond; ++axis) {
      const auto ua = static_cast<std::size_t>(axis);
      const RowView view(lattice_.grid(), state.u[ua].data(), row);
      beyond = row_near_limits(couplings().springs(row, axis), view, yield_limits_[ua], 1.0F, view.own);
    }
    if (!beyond) return false;
  }
  const RowPlasticity found = plastic_row(couplings(), state, row, keep);
  note_change(0, row, found.moved_m);
  return found.uncommitted;
}

void Multigrid::smooth(int level, RowId row, Displacement& state, const ObstacleView& obstacles,
                       LaneSpan span) noexcept {
  if (blocks_ != nullptr && blocks_->fill_row(level, row)) return;  // blocks move as one
  const LevelRow r = row_of(level, row, state);
  log_.note(level, row);
  if (level > 0) {
    float change = smooth_row(r, nullptr, span);
    if (boundary_springs_->tilted(level, row)) change = std::max(change, smooth_tilted(level, row, r, span));
    note_change(level, row, change);
    return;
  }
  note_change(0, row, smooth_voxels(r, row, state, obstacles, span));
}

std::array<RowId, 8> Multigrid::rows_below(int level, RowId row) const noexcept {
  const Grid& g = grid(level - 1);
  const auto c = grid(level).row_coordinates(row);
  const RowId first = g.row(2 * (c[0] - 1) + 1, 2 * c[1], 2 * c[2]);
  std::array<RowId, 8> below;
  for (RowId child = 0; child < 8; ++child)
    below[child] = first + (child & 1U) * g.row_x + (child >> 1U & 1U) + (child >> 2U) * g.row_z;
  return below;
}

namespace {

// Float8 of finer row `half` (0 or 1) that lie below the given Float8 of a coarse row. Empty (first > last)
// if there are none.
LaneSpan octets_below(LaneSpan coarse, int half) {
  const int from = half * kLaneGroups / 2;
  return {2 * (std::max(coarse.first, from) - from),
          2 * (std::min(coarse.last, from + kLaneGroups / 2 - 1) - from) + 1};
}

}  // namespace

void Multigrid::restrict_values(int level, RowId row, Displacement& state, LaneSpan span) noexcept {
  Level& l = at(level);
  log_.note(level, row);
  const std::size_t begin = static_cast<std::size_t>(row) * kRow;
  RowVector sums{};
  std::array<float*, 3> value{}, prolonged{};
  const std::array<RowId, 8> rows = rows_below(level, row);
  for (std::size_t child = 0; child < 8; ++child) {
    const int half = static_cast<int>(child & 1U);
    const LaneSpan below = octets_below(span, half);
    if (below.first > below.last) continue;
    const std::size_t fine = static_cast<std::size_t>(rows[child]) * kRow;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float* u = (level == 1 ? state.u : at(level - 1).value)[axis].data() + fine;
      add_pairs(u, below, sums[axis].data() + half * kRow / 2);
    }
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    value[axis] = l.value[axis].data() + begin;
    prolonged[axis] = l.prolonged[axis].data() + begin;
  }
  take_means(sums, l.couplings->share(row), value, prolonged, span);
}

void Multigrid::freeze_residual(RowId row, Displacement& state, const ObstacleView& obstacles,
                                LaneSpan span) noexcept {
  if (!prepare(0, row) || frozen_rows_.size() == frozen_rows_.capacity()) return;
  RowVector left;
  residual_of(0, row, state, obstacles, span, left);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    float* to = frozen_residual_.data() + (frozen_rows_.size() * 3 + axis) * kRow;
    const float* own = state.load_of(row, static_cast<int>(axis));
    for (std::size_t i = 0; i < kRow; ++i) to[i] = own == nullptr ? 0.0F : own[i];
    for (std::size_t i = static_cast<std::size_t>(span.first) * kLanes;
         i < static_cast<std::size_t>(span.last + 1) * kLanes; ++i)
      to[i] -= left[axis][i];
  }
  frozen_rows_.push_back(row);
  frozen_number_[row] = static_cast<std::uint16_t>(frozen_rows_.size());
}

void Multigrid::keep_frozen_residual(float part, const Displacement& state) noexcept {
  for (std::size_t n = 0; n < frozen_rows_.size(); ++n) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      float* of_row = frozen_residual_.data() + (n * 3 + axis) * kRow;
      const float* own = state.load_of(frozen_rows_[n], static_cast<int>(axis));
      for (std::size_t i = 0; i < kRow; ++i) {
        const float beside = own == nullptr ? 0.0F : own[i];
        of_row[i] = beside + part * (of_row[i] - beside);
      }
    }
  }
  for (BlockState& p : block_state_) p.frozen_N *= static_cast<double>(part);
}

void Multigrid::add_limit_loads(RowId row, LevelRow& r, RowVector& loads) noexcept {
  const std::size_t begin = static_cast<std::size_t>(row) * kRow;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < kRow; ++i)
      loads[axis][i] = limit_load_[axis][begin + i] + (r.load[axis] == nullptr ? 0.0F : r.load[axis][i]);
    r.load[axis] = loads[axis].data();
  }
}

// Residual of the voxels or cells of a row that are free to move.
RowResidual Multigrid::residual_of(int level, RowId row, Displacement& state, const ObstacleView& obstacles,
                                   LaneSpan span, RowVector& out) noexcept {
  LevelRow r = row_of(level, row, state);
  if (level > 0) {
    RowResidual found = residual_row(r, nullptr, 0.0F, span, out);
    if (boundary_springs_->tilted(level, row)) {
      add_tilt(level, row, r, span, out);
      measure_row(r.springs, out, span, found);
    }
    return found;
  }
  const RowLimits limits = couplings().limits(row);
  const float tight = kAtLimit * static_cast<float>(lattice_.min_spacing_m());
  RowVector loads;
  const bool ties = row_has_limit_load_[row] != 0;
  if (ties) add_limit_loads(row, r, loads);
  RowResidual found = residual_row(r, restricts_all_ ? nullptr : &limits, tight, span, out);
  if (state.row_obstacles[row] != 0 || state.row_standing[row] != 0 || boundary_springs_->supports(row)) {
    balance_contacts(row, state, obstacles, span, found, out);
    measure_row(r.springs, out, span, found);
  }
  for (std::size_t axis = 0; axis < 3 && ties; ++axis) {
    const float* tied = limit_load_[axis].data() + static_cast<std::size_t>(row) * kRow;
    for (std::size_t i = static_cast<std::size_t>(span.first) * kLanes;
         i < static_cast<std::size_t>(span.last + 1) * kLanes; ++i) {
      if (tied[i] != 0.0F)
        stop_cells(static_cast<VoxelId>(row * kRow + i), static_cast<std::uint8_t>(1U << axis));
    }
  }
  // Active limits balance the residual against them. If this residual were restricted, coarse levels would
  // push against links that do not yield, and later sweeps would undo the correction.
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < kRow && found.resisted[axis] >> i != 0; ++i) {
      if ((found.resisted[axis] >> i & 1U) != 0)
        stop_cells(static_cast<VoxelId>(row * kRow + i), static_cast<std::uint8_t>(1U << axis));
    }
  }
  return found;
}

float Multigrid::restrict_loads(int level, RowId row, Displacement& state, const ObstacleView& obstacles,
                                LaneSpan span) noexcept {
  LevelStiffness& finer = *at(level - 1).couplings;
  float worst = 0.0F;
  RowVector sums{};
  const std::array<RowId, 8> rows = rows_below(level, row);
  for (std::size_t child = 0; child < 8; ++child) {
    const RowId fine = rows[child];
    const int half = static_cast<int>(child & 1U);
    const LaneSpan below = octets_below(span, half);
    if (below.first > below.last || !finer.prepare(fine)) continue;
    // blocks get their residual from their borders
    if (blocks_ != nullptr && blocks_->fill_known_row(level - 1, fine)) {
      if (span.whole()) unmark(level - 1, fine, active | dirty);
      continue;
    }
    RowVector residual;
    RowResidual left;
    if (blocks_ == nullptr || !blocks_->fill_row(level - 1, fine)) {
      left = residual_of(level - 1, fine, state, obstacles, below, residual);
    } else {
      residual = {};
    }
    worst = std::max(worst, left.most_N);
    if (blocks_ != nullptr && blocks_->in_row(level - 1, fine))
      set_block_lanes(level - 1, fine, below, residual);
    for (std::size_t axis = 0; axis < 3; ++axis)
      add_pairs(residual[axis].data(), below, sums[axis].data() + half * kRow / 2);
    if (!span.whole()) continue;
    // For voxels the tolerance is a force, for cells a displacement, which is the same on all levels.
    const bool at_rest = level == 1 ? left.most_N < tolerance_N_ : left.most_way_m < motion_tolerance_m_;
    unmark(level - 1, fine, at_rest ? active | dirty : dirty);
    if (!at_rest) mark(level - 1, fine, active);
  }
  log_.note(level, row);
  if (blocks_ != nullptr && blocks_->in_row(level, row)) restrict_block_lanes(level, row, span, sums);
  take_loads(prolonged_row(level, row), sums, loads(level, row), span);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t begin =
        static_cast<std::size_t>(row) * kRow + static_cast<std::size_t>(span.first) * kLanes;
    std::copy_n(at(level).prolonged[axis].data() + begin, (span.last - span.first + 1) * kLanes,
                at(level).loaded_at[axis].data() + begin);
  }
  spread(level, row, active | dirty);
  return worst;
}

}  // namespace voxel
