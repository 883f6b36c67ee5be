// SPDX-License-Identifier: GPL-3.0-or-later
// The passes of which a cycle is made.
#include <algorithm>

#include "voxel/sparse/multigrid.h"

namespace voxel::sparse {
namespace {

constexpr double kTouching = 1e-6;  // of the spacing: nearer to its obstacle than this a voxel lies on it
constexpr float kTight = 1e-4F;     // of the spacing: nearer to its limit than this a link is at it

}  // namespace

LevelRow Multigrid::row_of(int level, RowId row, Displacement& state) noexcept {
  Level& l = at(level);
  const Grid& g = l.couplings->grid();
  const std::size_t begin = static_cast<std::size_t>(row) * kRow;
  LevelRow r;
  r.springs = l.couplings->all(row);
  r.z = static_cast<std::ptrdiff_t>(g.row_z) * kRow;
  r.x = static_cast<std::ptrdiff_t>(g.row_x) * kRow;
  if (level == 0) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      r.u[axis] = state.u[axis].data() + begin;
      r.load[axis] = state.rest.load_of(row, static_cast<int>(axis));
    }
    if (state.row_held[row] != 0) r.held = state.role.data() + begin;
    return r;
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    r.u[axis] = l.value[axis].data() + begin;
    r.load[axis] = l.load[axis].data() + begin;
    r.told[axis] = l.told[axis].data() + begin;
  }
  if (l.row_held[row] != 0) r.hold = l.hold.data() + begin;
  r.hold_times = hold_;
  if (!stopped_.empty()) r.stopped = l.stopped.data() + begin;
  return r;
}

bool Multigrid::yield(RowId row, Displacement& state, bool keep) noexcept {
  if (state.rest.row[row] == 0) {
    bool beyond = false;
    for (int axis = 0; axis < 3 && !beyond; ++axis) {
      const auto ua = static_cast<std::size_t>(axis);
      const RowView view(lattice_.grid(), state.u[ua].data(), row);
      beyond = row_near_limits(couplings().springs(row, axis), view, yield_limits_[ua], 1.0F, view.own);
    }
    if (!beyond) return false;
  }
  const RowYield found = yield_row(couplings(), state, row, keep);
  note_change(0, row, found.moved_m);
  return found.unkept;
}

void Multigrid::smooth(int level, RowId row, Displacement& state, const ObstacleView& obstacles,
                       OctetSpan span) noexcept {
  const LevelRow r = row_of(level, row, state);
  if (level > 0) {
    note_change(level, row, smooth_row(r, nullptr, span));
    return;
  }
  const RowLimits limits = couplings().limits(row);
  const float change = smooth_row(r, &limits, span);
  if (!obstacles.obstacles.empty() && state.row_obstacles[row] != 0) {
    for (VoxelId v = row * kRow; v < (row + 1) * kRow; ++v) {
      if (state.role[v] == Displacement::obstacle) relax_obstacle(couplings(), state, obstacles, v);
    }
  }
  note_change(0, row, change);
}

RowId Multigrid::row_below(int level, RowId row, int child) const noexcept {
  const auto c = grid(level).row_coordinates(row);
  return grid(level - 1).row(2 * (c[0] - 1) + 1 + (child & 1), 2 * c[1] + (child >> 1 & 1),
                             2 * c[2] + (child >> 2));
}

namespace {

// The octets of the half-th finer row that octets of a coarse row hold; none: first > last.
OctetSpan octets_below(OctetSpan coarse, int half) {
  const int from = half * kOctets / 2;
  return {2 * (std::max(coarse.first, from) - from),
          2 * (std::min(coarse.last, from + kOctets / 2 - 1) - from) + 1};
}

}  // namespace

void Multigrid::restrict_values(int level, RowId row, Displacement& state, OctetSpan span) noexcept {
  Level& l = at(level);
  const std::size_t begin = static_cast<std::size_t>(row) * kRow;
  RowVector sums{};
  std::array<float*, 3> value{}, told{};
  for (int child = 0; child < 8; ++child) {
    const int half = child & 1;
    const OctetSpan below = octets_below(span, half);
    if (below.first > below.last) continue;
    const std::size_t fine = static_cast<std::size_t>(row_below(level, row, child)) * kRow;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float* u = (level == 1 ? state.u : at(level - 1).value)[axis].data() + fine;
      add_pairs(u, below, sums[axis].data() + half * kRow / 2);
    }
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    value[axis] = l.value[axis].data() + begin;
    told[axis] = l.told[axis].data() + begin;
  }
  take_means(sums, l.couplings->all(row).share, value, told, span);
}

// What pulls the voxels, or cells, of a row that are free to follow.
RowResidual Multigrid::residual_of(int level, RowId row, Displacement& state, const ObstacleView& obstacles,
                                   OctetSpan span, RowVector& out) noexcept {
  const LevelRow r = row_of(level, row, state);
  if (level > 0) return residual_row(r, nullptr, 0.0F, span, out);
  const RowLimits limits = couplings().limits(row);
  const float tight = kTight * static_cast<float>(lattice_.min_spacing_m());
  RowResidual found = residual_row(r, &limits, tight, span, out);
  if (state.row_obstacles[row] != 0) {
    // What an obstacle holds is balanced by it.
    const double touching = kTouching * lattice_.min_spacing_m();
    for (std::size_t i = 0; i < kRow; ++i) {
      const auto v = static_cast<VoxelId>(row * kRow + i);
      if (state.role[v] != Displacement::obstacle || !blocked(obstacles, state, v, touching)) continue;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        out[axis][i] = 0.0F;
        found.resisted[axis] &= ~(1U << i);
      }
    }
    measure_row(r.springs, out, span, found);
  }
  // What the chain holds is balanced by it. Passed on, its residual would drive the coarse levels against
  // links that do not give, and the sweeps after would undo it.
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < kRow && found.resisted[axis] >> i != 0; ++i) {
      if ((found.resisted[axis] >> i & 1U) != 0)
        stop_cells(static_cast<VoxelId>(row * kRow + i), static_cast<std::uint8_t>(1U << axis));
    }
  }
  return found;
}

float Multigrid::restrict_loads(int level, RowId row, Displacement& state, const ObstacleView& obstacles,
                                OctetSpan span) noexcept {
  Couplings& finer = *at(level - 1).couplings;
  float worst = 0.0F;
  RowVector sums{};
  for (int child = 0; child < 8; ++child) {
    const RowId fine = row_below(level, row, child);
    const int half = child & 1;
    const OctetSpan below = octets_below(span, half);
    if (below.first > below.last || !finer.prepare(fine)) continue;
    RowVector residual;
    const RowResidual left = residual_of(level - 1, fine, state, obstacles, below, residual);
    worst = std::max(worst, left.most_N);
    for (std::size_t axis = 0; axis < 3; ++axis)
      add_pairs(residual[axis].data(), below, sums[axis].data() + half * kRow / 2);
    if (!span.whole()) continue;
    // Of voxels as a force, of cells as a displacement, whose threshold is the same on all levels.
    const bool at_rest = level == 1 ? left.most_N < tolerance_N_ : left.most_way_m < quiet_m_;
    unmark(level - 1, fine, at_rest ? active | dirty : dirty);
    if (!at_rest) mark(level - 1, fine, active);
  }
  take_loads(told_row(level, row), sums, loads(level, row), span);
  spread(level, row, active | dirty);
  return worst;
}

LevelRow Multigrid::told_row(int level, RowId row) noexcept {
  Level& l = at(level);
  const Grid& g = l.couplings->grid();
  LevelRow r;
  r.springs = l.couplings->all(row);
  r.z = static_cast<std::ptrdiff_t>(g.row_z) * kRow;
  r.x = static_cast<std::ptrdiff_t>(g.row_x) * kRow;
  for (std::size_t axis = 0; axis < 3; ++axis)
    r.u[axis] = l.told[axis].data() + static_cast<std::size_t>(row) * kRow;
  return r;
}

std::array<float*, 3> Multigrid::loads(int level, RowId row) noexcept {
  Level& l = at(level);
  const std::size_t begin = static_cast<std::size_t>(row) * kRow;
  return {l.load[0].data() + begin, l.load[1].data() + begin, l.load[2].data() + begin};
}

float Multigrid::untold(int level, RowId row, OctetSpan span) const noexcept {
  const Level& l = at(level);
  const std::size_t begin = static_cast<std::size_t>(row) * kRow;
  float most = 0.0F;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    most = std::max(most, row_difference(l.value[axis].data() + begin, l.told[axis].data() + begin, span));
  }
  return most;
}

void Multigrid::end_telling(int level, RowId row, int first, int last) noexcept {
  Level& l = at(level);
  const int origin = (grid(level).row_coordinates(row)[0] - 1) * kRow;
  const int from = std::max(first - origin, 0), to = std::min(last - origin, kRow - 1);
  const std::size_t begin = static_cast<std::size_t>(row) * kRow;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (int i = from; i <= to; ++i)
      l.told[axis][begin + static_cast<std::size_t>(i)] = l.value[axis][begin + static_cast<std::size_t>(i)];
  }
  if ((from == 0 && to == kRow - 1) || untold(level, row) == 0.0F) unmark(level, row, changed);
}

float Multigrid::correct(int level, RowId row, const RowVector& correction, Displacement& state,
                         OctetSpan span) noexcept {
  LevelRow r = row_of(level, row, state);
  if (level > 0) return correct_row(r, nullptr, span, correction);
  // A voxel that pulls against a link at its limit stays, until the limit lets go of it.
  if (!stopped_.empty()) r.stopped = at(0).stopped.data() + static_cast<std::size_t>(row) * kRow;
  const RowLimits limits = couplings().limits(row);
  return correct_row(r, &limits, span, correction);
}

void Multigrid::prolong(int level, RowId row, Displacement& state, const ObstacleView& obstacles,
                        OctetSpan span, int first, int last) noexcept {
  Level& coarse = at(level + 1);
  const Grid& g = coarse.couplings->grid();
  const auto c = grid(level).row_coordinates(row);
  const int column = (c[0] - 1) / 2 + 1;
  const int own_j = c[1] / 2, own_k = c[2] / 2;
  const int near_j = (c[1] & 1) != 0 ? own_j + 1 : own_j - 1,
            near_k = (c[2] & 1) != 0 ? own_k + 1 : own_k - 1;
  const std::array<RowId, 4> rows{g.row(column, own_j, own_k), g.row(column, near_j, own_k),
                                  g.row(column, own_j, near_k), g.row(column, near_j, near_k)};
  bool any = false;
  for (const RowId r : rows) any = any || (coarse.flags[r] & telling) != 0;
  if (!any) return;
  CoarseRows around;
  around.half = (c[0] - 1) % 2 * (kRow / 2);
  around.x = static_cast<std::ptrdiff_t>(g.row_x) * kRow;
  around.first_teller = first - (column - 1) * kRow;
  around.last_teller = last - (column - 1) * kRow;
  const auto filled = [&coarse](RowId r) {
    return coarse.couplings->prepare(r) ? coarse.couplings->filled(r) : nullptr;
  };
  for (std::size_t n = 0; n < 4; ++n) {
    CoarseRows::One& one = around.row[n];
    one.tells = (coarse.flags[rows[n]] & telling) != 0;
    one.filled = filled(rows[n]);
    if (around.half == 0 && span.first == 0) one.filled_left = filled(rows[n] - g.row_x);
    if (around.half != 0 && span.last == kOctets - 1) one.filled_right = filled(rows[n] + g.row_x);
    const std::size_t begin = static_cast<std::size_t>(rows[n]) * kRow;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      one.value[axis] = coarse.value[axis].data() + begin;
      one.told[axis] = coarse.told[axis].data() + begin;
    }
  }
  RowVector correction;
  interpolate_row(around, span, correction);
  // Beyond these lanes no hat reaches.
  const int origin = (c[0] - 1) * kRow;
  span.first = std::max(span.first, (std::max(2 * first - 1, origin) - origin) / kOctet);
  span.last = std::min(span.last, (2 * last + 2 - origin) / kOctet);
  if (span.first > span.last) return;
  const float most = correct(level, row, correction, state, span);
  if (level == 0 && most > 0.0F) clear_obstacles(row, state, obstacles);
  note_change(level, row, most);
}

void Multigrid::clear_obstacles(RowId row, Displacement& state, const ObstacleView& obstacles) noexcept {
  if (obstacles.obstacles.empty() || state.row_obstacles[row] == 0) return;
  for (VoxelId v = row * kRow; v < (row + 1) * kRow; ++v) {
    if (state.role[v] == Displacement::obstacle) clear_obstacle(lattice_, state, obstacles, v);
  }
}

}  // namespace voxel::sparse
