// SPDX-License-Identifier: GPL-3.0-or-later
// Prolongation: coarse corrections are interpolated trilinearly and applied within the limits of links.
#include <algorithm>

#include "voxel/lattice/prefetch.h"
#include "voxel/multigrid/fas.h"

namespace voxel {

namespace {

constexpr int kRowsAhead = 4;  // rows along y that are prefetched

}  // namespace

LevelRow Multigrid::prolonged_row(int level, RowId row) noexcept {
  Level& l = at(level);
  const Grid& g = l.couplings->grid();
  LevelRow r;
  l.couplings->all(row, r.springs);
  r.z = static_cast<std::ptrdiff_t>(g.row_z) * kRow;
  r.x = static_cast<std::ptrdiff_t>(g.row_x) * kRow;
  for (std::size_t axis = 0; axis < 3; ++axis)
    r.u[axis] = l.prolonged[axis].data() + static_cast<std::size_t>(row) * kRow;
  return r;
}

std::array<float*, 3> Multigrid::loads(int level, RowId row) noexcept {
  Level& l = at(level);
  const std::size_t begin = static_cast<std::size_t>(row) * kRow;
  return {l.load[0].data() + begin, l.load[1].data() + begin, l.load[2].data() + begin};
}

float Multigrid::pending_correction(int level, RowId row, LaneSpan span, int first, int last) const noexcept {
  const Level& l = at(level);
  const std::size_t begin = static_cast<std::size_t>(row) * kRow;
  float most = 0.0F;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    most = std::max(most, row_difference(l.value[axis].data() + begin, l.prolonged[axis].data() + begin, span,
                                         first, last));
  }
  return most;
}

void Multigrid::forget_pending_correction(int level, RowId row, Displacement& state,
                                          const ObstacleView& obstacles) noexcept {
  Level& l = at(level);
  const std::size_t begin = static_cast<std::size_t>(row) * kRow;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::fill_n(l.value[axis].data() + begin, kRow, 0.0F);
    std::fill_n(l.prolonged[axis].data() + begin, kRow, 0.0F);
  }
  if (blocks_ != nullptr && blocks_->in_row(level, row)) forget_pending_of_blocks(level, row);
  restrict_values(level, row, state);
  restrict_loads(level, row, state, obstacles);
  unmark(level, row, changed);
}

// Takes the pending corrections of one row of cells along all of the box, and interpolates them along x.
// Afterwards they count as prolonged.
void Multigrid::interpolate_row(int level, int j, int k, const ProlongedBox& box) noexcept {
  Level& l = at(level);
  const Grid& g = l.couplings->grid();
  bool is_source = false, whole = true;
  const int before = prolongation_.first() - 1, after = prolongation_.first() + prolongation_.groups();
  for (int q = before; q <= after; ++q) {
    const int column = (q + kLaneGroups) / kLaneGroups;  // column 0 is the empty one before the first
    const RowId row = g.row(column, j, k);
    is_source = is_source || (q > before && q < after && has(level, row, source));
    whole = whole && l.couplings->prepare(row) && l.couplings->uniform(row);
  }
  const auto add = [this](std::size_t which, int q) {
    return prolongation_.cells(which) + static_cast<std::ptrdiff_t>(q - prolongation_.first()) * kLanes;
  };
  const Float8 none{};
  for (int q = before; q <= after && (is_source || !whole); ++q) {
    const int column = (q + kLaneGroups) / kLaneGroups;
    const RowId row = g.row(column, j, k);
    const int group = (q + kLaneGroups) % kLaneGroups;
    const bool any = l.couplings->prepare(row);
    if (!whole) {
      if (any) {
        std::copy_n(l.couplings->filled(row) + group * kLanes, kLanes, add(3, q));
      } else {
        store(add(3, q), none);
      }
    }
    const bool here = any && q > before && q < after && has(level, row, source);
    const int origin = (column - 1) * kRow;
    const std::size_t begin = static_cast<std::size_t>(row) * kRow;
    for (std::size_t axis = 0; axis < 3 && is_source; ++axis) {
      if (here) {
        take_pending_correction(l.value[axis].data() + begin, l.prolonged[axis].data() + begin,
                                l.couplings->filled(row), {group, group}, box.first_source - origin,
                                box.last_source - origin, add(axis, q));
      } else {
        store(add(axis, q), none);
      }
    }
  }
  if (is_source) {
    for (int c = prolongation_.first() / kLaneGroups; c <= (after - 1) / kLaneGroups; ++c) {
      const RowId row = g.row(c + 1, j, k);
      if (!has(level, row, source)) continue;
      unmark(level, row, source);
      log_.note(level, row);
      if (pending_correction(level, row) == 0.0F) unmark(level, row, changed);
    }
  }
  prolongation_.spread(j, k, is_source, whole);
}

void Multigrid::prolong(int level, const ProlongedBox& box, Displacement& state,
                        const ObstacleView& obstacles, bool jointly) noexcept {
  const Grid& g = grid(level);
  // the lower one of the two cells around a voxel
  const auto below = [](int x) { return (x + 1) / 2 - 1; };
  if (box.from_k == box.k0) prolongation_.begin(box.q0 / 2, box.q1 / 2, below(box.j0), below(box.j1) + 1);
  // beyond these Float8 there is no correction
  const int q0 = std::max(box.q0, std::max(2 * box.first_source - 1, 0) / kLanes);
  const int q1 = std::min(box.q1, (2 * box.last_source + 2) / kLanes);
  int spread = box.from_k == box.k0 ? below(box.k0) - 1
                                    : below(box.from_k - 1) + 1;  // last interpolated plane of cells
  for (int k = box.from_k; k <= box.to_k; ++k) {
    for (; spread <= below(k); ++spread) {
      for (int j = below(box.j0); j <= below(box.j1) + 1; ++j) interpolate_row(level + 1, j, spread + 1, box);
    }
    const int own_k = k / 2, near_k = (k & 1) != 0 ? own_k + 1 : own_k - 1;
    for (int j = box.j0; j <= box.j1; ++j) {
      const int own_j = j / 2, near_j = (j & 1) != 0 ? own_j + 1 : own_j - 1;
      const auto prolongation = [&](int group) {
        return std::array<ProlongedRow, 4>{
            prolongation_.row(own_j, own_k, group), prolongation_.row(near_j, own_k, group),
            prolongation_.row(own_j, near_k, group), prolongation_.row(near_j, near_k, group)};
      };
      const auto here = prolongation(q0);
      if (std::none_of(here.begin(), here.end(), [](const ProlongedRow& r) { return r.is_source; })) continue;
      for (int c = q0 / kLaneGroups; c <= q1 / kLaneGroups; ++c) {
        const RowId row = g.row(c + 1, j, k);
        if (!prepare(level, row)) continue;
        const int first = std::max(q0, c * kLaneGroups),
                  last = std::min(q1, c * kLaneGroups + kLaneGroups - 1);
        if (j + kRowsAhead <= box.j1) fetch(level, row + kRowsAhead, state);
        prolong_row(level, row, prolongation(first), state, obstacles,
                    {first - c * kLaneGroups, last - c * kLaneGroups}, jointly && level == 0);
      }
    }
  }
  if (jointly && level == 0) {
    apply_limited_correction(state);
    for (const LimitedCorrection::Row& r : limited_correction_.rows()) {
      if (!r.aims) continue;
      Refused refused{.row = r.row, .axes = 0, .span = r.span, .way = {}};
      refused.axes = left_of(r, state, refused.way);
      if (refused.axes != 0) take_back_refused(0, refused);
    }
    limited_correction_.clear();
  }
  if (blocks_ != nullptr && box.to_k == box.k1) prolong_to_blocks(level, state, obstacles);
}

// Prefetches the values that a correction is added to: no cache has them.
void Multigrid::fetch(int level, RowId row, const Displacement& state) const noexcept {
  if (blocks_ != nullptr && blocks_->fill_known_row(level, row)) return;  // corrected as wholes
  for (const auto& axis : level == 0 ? state.u : at(level).value)
    prefetch_range(axis.data() + static_cast<std::size_t>(row) * kRow, kRow * sizeof(float));
}

void Multigrid::prolong_row(int level, RowId row, const std::array<ProlongedRow, 4>& prolongation,
                            Displacement& state, const ObstacleView& obstacles, LaneSpan span,
                            bool jointly) noexcept {
  if (level == 0 && blocks_ != nullptr && blocks_->fill_known_row(level, row))
    return;  // corrected as a whole
  // Rows near obstacles are corrected alone, before those that move together.
  LimitedCorrection::Row* const together =
      jointly && state.row_obstacles[row] == 0 && !limited_correction_.full()
          ? &limited_correction_.add(row, span)
          : nullptr;
  RowVector alone;
  RowVector& correction = together != nullptr ? together->from : alone;
  sum_interpolated(prolongation, span, correction);
  for (std::size_t axis = 0; axis < 3 && level > 0 && boundary_springs_->any(level, row); ++axis) {
    const float* nearer = boundary_springs_->nearer(level, row, axis);
    for (std::size_t i = static_cast<std::size_t>(span.first) * kLanes;
         i < static_cast<std::size_t>(span.last + 1) * kLanes; ++i)
      correction[axis][i] /= 1.0F + nearer[i];
  }
  log_.note(level, row);
  if (blocks_ != nullptr && blocks_->in_row(level, row)) note_prolonged_blocks(level, row, span, correction);
  if (together != nullptr) {
    // Without obstacles all rows move together. So this row can move now: it blocks no row that moves alone.
    if (obstacles.obstacles.empty()) set_out(*together, state);
    return;
  }
  Refused refused;
  correct(level, row, correction, state, obstacles, span, refused);
  if (refused.axes != 0) take_back_refused(level, refused);
}

void Multigrid::correct(int level, RowId row, const RowVector& correction, Displacement& state,
                        const ObstacleView& obstacles, LaneSpan span, Refused& refused) noexcept {
  LevelRow r = row_of(level, row, state);
  RowCorrection done;
  if (level > 0) {
    done = correct_row(r, nullptr, span, correction, refused.way);
  } else {
    // A voxel that pulls against an active limit stays until the limit is released.
    if (has(0, row, limited)) r.stopped = at(0).stopped.data() + static_cast<std::size_t>(row) * kRow;
    done = correct_voxels(r, row, correction, state, obstacles, span, refused.way);
  }
  refused.row = row;
  refused.axes = done.refused;
  refused.span = span;
  note_change(level, row, done.most_m);
}

void Multigrid::take_back_refused(int level, const Refused& refused) noexcept {
  const LaneSpan span = refused.span;
  Level& coarse = at(level + 1);
  const auto c = grid(level).row_coordinates(refused.row);
  const RowId above = coarse.couplings->grid().row((c[0] - 1) / 2 + 1, c[1] / 2, c[2] / 2);
  log_.note(level + 1, above);
  const int half = (c[0] - 1) % 2;
  const LaneSpan pairs{span.first & ~1, span.last | 1};
  RowVector sums{}, lanes{};
  std::array<float*, 3> value{}, prolonged{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    value[axis] = coarse.value[axis].data() + static_cast<std::size_t>(above) * kRow;
    prolonged[axis] = coarse.prolonged[axis].data() + static_cast<std::size_t>(above) * kRow;
    if ((refused.axes >> axis & 1U) == 0) continue;
    std::copy_n(refused.way[axis].begin() + span.first * kLanes, (span.last - span.first + 1) * kLanes,
                lanes[axis].begin() + span.first * kLanes);
    add_pairs(lanes[axis].data(), pairs, sums[axis].data() + half * kRow / 2);
  }
  take_back(sums, coarse.couplings->share(above), value, prolonged,
            {half * kLaneGroups / 2 + pairs.first / 2, half * kLaneGroups / 2 + pairs.last / 2});
  spread(level + 1, above, active | dirty);
}

}  // namespace voxel
