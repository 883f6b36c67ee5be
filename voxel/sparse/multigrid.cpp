// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/sparse/multigrid.h"

#include <algorithm>
#include <cmath>

#include "voxel/wide.h"

namespace voxel::sparse {
namespace {

constexpr int kMaxLevels = 10;
constexpr int kSmallest = 3;             // cells across the coarsest level
constexpr int kWrittenAtOnce = 3;        // from this level on springs are written out on construction
constexpr std::size_t kMaxHeld = 65536;  // cells of all levels held at a time; more move a little
constexpr double kTouching = 1e-6;  // of the spacing: nearer to its obstacle than this a voxel lies on it
// A cycle over a held disc of 2, 4, 8, 16 or 24 spacings' radius leaves 0.5, 0.5, 0.5, 0.4 and 0.6 of what it
// found; with kSide 1.4, all that statics asks for, the layer under a wide one swung (−0.9 at 8 spacings).
constexpr float kDisc = 0.5F, kSide = 28.0F;
constexpr std::uint16_t kMostCounted = 65535;
constexpr float kNearLimit = 0.999F;       // of the tightest limit: within this no link is at its limit
constexpr float kPassedOn = 1.0F / 32.0F;  // of what a row is left alone with: less is not passed on either
constexpr auto kOnes = [] {
  Row ones{};
  for (float& x : ones) x = 1.0F;
  return ones;
}();

// How hard n held voxels hold the cell of size³ they are in, in units of all springs of the cell: few of them
// as a disc on a half-space, 4·κ·a with a = h·sqrt(n/π); a whole side of them as the fine links under it do
// before sweeps have reached the cell's depth.
float hold_of(std::uint16_t n, float size) {
  const float covered = std::sqrt(static_cast<float>(n)) / size;
  return (kDisc + kSide * covered) * covered;
}

// Where the children of coarse row (c, j, k) begin: two columns, two rows in y, two in z.
struct Children {
  int column, j, k;
};
Children children_of(const Grid& coarse, RowId row) {
  const auto c = coarse.row_coordinates(row);
  return {2 * (c[0] - 1) + 1, 2 * c[1], 2 * c[2]};
}

// Adds neighbouring lanes of a fine row into half a coarse row.
HYBRID_WIDE void add_pairs(const float* fine, float* half) noexcept {
  for (int m = 0; m < kRow / 2; ++m) half[m] += fine[2 * m] + fine[2 * m + 1];
}

}  // namespace

Multigrid::Multigrid(const Lattice& lattice)
    : lattice_(lattice), limits_{AxisLimits(lattice, 0), AxisLimits(lattice, 1), AxisLimits(lattice, 2)} {
  levels_.reserve(kMaxLevels);
  while (levels() < kMaxLevels) {
    Level level;
    const Couplings* finer = levels_.empty() ? nullptr : levels_.back().couplings.get();
    level.couplings = std::make_unique<Couplings>(lattice, finer);
    const Grid& g = level.couplings->grid();
    if (finer != nullptr) {
      for (auto* arrays : {&level.value, &level.told, &level.load, &level.telling}) {
        for (auto& array : *arrays) array = LazyArray<float>(g.size());
      }
      level.held = LazyArray<std::uint16_t>(g.size());
      level.row_held = LazyArray<std::uint8_t>(g.rows());
    }
    level.stopped = LazyArray<std::uint8_t>(g.size());
    level.flags = LazyArray<std::uint8_t>(g.rows());
    level.plane_flags = LazyArray<std::uint8_t>(g.rows() / g.row_z);
    levels_.push_back(std::move(level));
    // One coarse level at least: it is where residuals are measured.
    if (levels() > 1 && *std::max_element(g.dims.begin(), g.dims.end()) <= kSmallest) break;
  }
  for (int l = kWrittenAtOnce; l < levels(); ++l) {
    const Grid& g = grid(l);
    for (int c = 1; c + 1 < g.columns; ++c) {
      for (int k = 0; k < g.dims[2]; ++k) {
        for (int j = 0; j < g.dims[1]; ++j) prepare(l, g.row(c, j, k));
      }
    }
  }
  held_.reserve(kMaxHeld);
  stopped_.reserve(kMaxHeld);
}

void Multigrid::mark(int level, RowId row, std::uint8_t flag) noexcept {
  Level& l = at(level);
  l.flags[row] |= flag;
  l.plane_flags[row / l.couplings->grid().row_z] |= flag;
}

// Marks a row and the rows beside it.
void Multigrid::spread(int level, RowId row, std::uint8_t flags) noexcept {
  Level& l = at(level);
  const Grid& g = l.couplings->grid();
  for (const RowId r : {row, row - 1, row + 1}) l.flags[r] |= flags;
  l.plane_flags[row / g.row_z] |= flags;
  for (const RowId r : {row - g.row_z, row + g.row_z, row - g.row_x, row + g.row_x}) {
    l.flags[r] |= flags;
    l.plane_flags[r / g.row_z] |= flags;
  }
}

// A row was moved by as much. What is too little for a sweep is still passed on: a small force on each of
// many voxels is a large one on the cell that holds them, four times as large on each level.
void Multigrid::note_change(int level, RowId row, float change) noexcept {
  if (change <= kPassedOn * quiet_m_) return;
  spread(level, row, change > quiet_m_ ? active | dirty : dirty);
  if (level > 0) mark(level, row, changed);
}

void Multigrid::set_held(std::span<const VoxelId> held) noexcept {
  for (const HeldCell& h : held_) {
    at(h.level).held[h.cell] = 0;
    at(h.level).row_held[h.cell / kRow] = 0;
  }
  held_.clear();
  for (const VoxelId v : held) {
    auto c = lattice_.coordinates(v);
    for (int l = 1; l < levels(); ++l) {
      for (int& x : c) x /= 2;
      Level& level = at(l);
      const VoxelId cell = level.couplings->grid().at(c[0], c[1], c[2]);
      if (level.held[cell] == 0) {
        if (held_.size() == held_.capacity()) return;
        held_.push_back({static_cast<std::uint8_t>(l), cell});
        level.row_held[cell / kRow] = 1;
      }
      if (level.held[cell] < kMostCounted) ++level.held[cell];
    }
  }
}

// Held voxels hold on to the cells above them as a disc of them holds on to a half-space: a spring to the
// mean of what the cell holds. (Cells that stand still as a whole were rejected: a cycle then gained a
// quarter; cells that know nothing of it swing past the contact.)
void Multigrid::keep_held(int level, RowId row, int axis, float* wanted) const noexcept {
  const Level& l = at(level);
  const std::size_t begin = static_cast<std::size_t>(row) * kRow;
  const float* rest = l.told[static_cast<std::size_t>(axis)].data() + begin;
  const float size = static_cast<float>(1 << level);
  for (std::size_t i = 0; i < kRow; ++i) {
    const std::uint16_t n = l.held[begin + i];
    if (n == 0) continue;
    const float hold = hold_ * hold_of(n, size);
    wanted[i] += (rest[i] - wanted[i]) * hold / (1.0F + hold);
  }
}

void Multigrid::stop_cells(VoxelId v, std::uint8_t bits) noexcept {
  auto c = lattice_.coordinates(v);
  for (int l = 0; l < levels(); ++l) {
    if (l > 0) {
      for (int& x : c) x /= 2;
    }
    Level& level = at(l);
    const VoxelId cell = level.couplings->grid().at(c[0], c[1], c[2]);
    if ((level.stopped[cell] & bits) == bits || stopped_.size() == stopped_.capacity()) return;
    level.stopped[cell] |= bits;
    stopped_.push_back({static_cast<std::uint8_t>(l), cell});
  }
}

void Multigrid::release_limited() noexcept {
  for (const HeldCell& s : stopped_) at(s.level).stopped[s.cell] = 0;
  stopped_.clear();
}

void Multigrid::smooth_voxels(RowId row, Displacement& state, const ObstacleView& obstacles) noexcept {
  const Grid& g = lattice_.grid();
  const std::size_t begin = static_cast<std::size_t>(row) * kRow;
  const bool held = state.row_held[row] != 0;
  float change = 0.0F;
  for (int axis = 0; axis < 3; ++axis) {
    const auto ua = static_cast<std::size_t>(axis);
    float* u = state.u[ua].data();
    const RowSprings springs = at(0).couplings->springs(row, axis);
    const RowView view(g, u, row);
    const auto keep_roles = [&](Row& wanted) {
      for (std::size_t i = 0; i < kRow; ++i) {
        if (state.role[begin + i] == Displacement::held) wanted[i] = u[begin + i];
      }
    };
    Row beside, next, wanted, before;
    row_beside(springs, view, nullptr, beside.data());
    std::copy_n(view.own, kRow, before.begin());
    next = before;
    for (const int first : {0, 1}) {
      row_minimum(springs, beside.data(), next.data(), view.left, view.right, wanted.data());
      if (held) keep_roles(wanted);
      take_row(next.data(), wanted.data(), first);
    }
    if (!row_near_limits(springs, view, limits_[ua], kNearLimit, next.data())) {
      std::copy(next.begin(), next.end(), u + begin);
    } else {
      for (const int first : {0, 1}) {
        row_minimum(springs, beside.data(), view.own, view.left, view.right, wanted.data());
        if (held) keep_roles(wanted);
        if (lattice_.uniform_limits()) {
          clamp_row(springs, view, limits_[ua], wanted.data());
        } else {
          for (std::size_t i = static_cast<std::size_t>(first); i < kRow; i += 2) {
            const auto v = static_cast<VoxelId>(begin + i);
            if (springs.inverse[i] == 0.0F || state.role[v] == Displacement::held) continue;
            wanted[i] = clamp_to(link_interval(lattice_, state, v, axis), wanted[i], u[v]);
          }
        }
        if (held) keep_roles(wanted);
        take_row(u + begin, wanted.data(), first);
      }
    }
    change = std::max(change, row_difference(view.own, before.data()));
  }
  if (!obstacles.obstacles.empty() && state.row_obstacles[row] != 0) {
    for (VoxelId v = row * kRow; v < (row + 1) * kRow; ++v) {
      if (state.role[v] == Displacement::obstacle) relax_obstacle(couplings(), state, obstacles, v);
    }
  }
  note_change(0, row, change);
}

void Multigrid::smooth_cells(int level, RowId row) noexcept {
  Level& l = at(level);
  const std::size_t begin = static_cast<std::size_t>(row) * kRow;
  float change = 0.0F;
  for (int axis = 0; axis < 3; ++axis) {
    const auto ua = static_cast<std::size_t>(axis);
    float* w = l.value[ua].data();
    const RowSprings springs = l.couplings->springs(row, axis);
    const RowView view(l.couplings->grid(), w, row);
    Row beside, wanted, before;
    row_beside(springs, view, l.load[ua].data() + begin, beside.data());
    std::copy_n(view.own, kRow, before.begin());
    for (const int first : {0, 1}) {
      row_minimum(springs, beside.data(), view.own, view.left, view.right, wanted.data());
      if (!l.couplings->uniform(row)) {
        // A cell that holds an anchor stays at the mean of what it holds.
        for (std::size_t i = 0; i < kRow; ++i)
          wanted[i] = springs.inverse[i] != 0.0F ? wanted[i] : w[begin + i];
      }
      if (l.row_held[row] != 0) keep_held(level, row, axis, wanted.data());
      if (!stopped_.empty()) {
        for (std::size_t i = 0; i < kRow; ++i) {
          if ((l.stopped[begin + i] & (1 << axis)) != 0) wanted[i] = w[begin + i];
        }
      }
      take_row(w + begin, wanted.data(), first);
    }
    change = std::max(change, row_difference(view.own, before.data()));
  }
  note_change(level, row, change);
}

void Multigrid::smooth(int level, RowId row, Displacement& state, const ObstacleView& obstacles) noexcept {
  if (level == 0) {
    smooth_voxels(row, state, obstacles);
  } else {
    smooth_cells(level, row);
  }
}

// The rows of the next finer level that a coarse row holds; false where the lattice ends.
bool Multigrid::rows_below(int level, RowId row, int child, RowId& fine) const noexcept {
  const Grid& below = grid(level - 1);
  Children first = children_of(grid(level), row);
  first.column += child & 1;
  first.j += child >> 1 & 1;
  first.k += child >> 2;
  if (first.column + 1 >= below.columns || first.j >= below.dims[1] || first.k >= below.dims[2]) return false;
  fine = below.row(first.column, first.j, first.k);
  return true;
}

void Multigrid::mean_of_children(int level, RowId row, int axis, const Displacement& state,
                                 Row& out) noexcept {
  Row count;
  out.fill(0.0F);
  count.fill(0.0F);
  Couplings& below = *at(level - 1).couplings;
  const float* u = values(level - 1, axis, state);
  bool all_full = true;
  for (int child = 0; child < 8; ++child) {
    RowId fine = 0;
    if (!rows_below(level, row, child, fine) || !below.prepare(fine)) {
      all_full = false;
      continue;
    }
    all_full = all_full && below.uniform(fine);
    add_pairs(u + static_cast<std::size_t>(fine) * kRow, out.data() + (child & 1) * kRow / 2);
  }
  if (all_full) {
    for (float& x : out) x *= 0.125F;
    return;
  }
  for (int child = 0; child < 8; ++child) {
    RowId fine = 0;
    if (!rows_below(level, row, child, fine)) continue;
    add_pairs(below.filled(fine), count.data() + (child & 1) * kRow / 2);
  }
  for (std::size_t i = 0; i < kRow; ++i) out[i] = count[i] > 0.0F ? out[i] / count[i] : 0.0F;
}

void Multigrid::restrict_values(int level, RowId row, const Displacement& state) noexcept {
  Level& l = at(level);
  const std::size_t begin = static_cast<std::size_t>(row) * kRow;
  for (int axis = 0; axis < 3; ++axis) {
    const auto ua = static_cast<std::size_t>(axis);
    Row mean;
    mean_of_children(level, row, axis, state, mean);
    float *value = l.value[ua].data() + begin, *told = l.told[ua].data() + begin;
    for (std::size_t i = 0; i < kRow; ++i) {
      value[i] = mean[i] + (value[i] - told[i]);
      told[i] = mean[i];
    }
  }
}

// What pulls the voxels of a row that are free to follow; returns the largest.
float Multigrid::residual_of(int level, RowId row, int axis, const Displacement& state,
                             const ObstacleView& obstacles, Row& r) noexcept {
  const auto ua = static_cast<std::size_t>(axis);
  const std::size_t begin = static_cast<std::size_t>(row) * kRow;
  Level& l = at(level);
  const RowSprings springs = l.couplings->springs(row, axis);
  const RowView view(l.couplings->grid(), values(level, axis, state), row);
  row_residual(springs, view, level == 0 ? nullptr : l.load[ua].data() + begin, r.data());
  if (level > 0) {
    if (l.row_held[row] != 0) {
      const float* diagonal = springs.inverse;
      const float* w = view.own;
      const float* rest = l.told[ua].data() + begin;
      for (std::size_t i = 0; i < kRow; ++i) {
        const std::uint16_t n = l.held[begin + i];
        if (n == 0 || diagonal[i] == 0.0F) continue;
        r[i] += hold_ * hold_of(n, static_cast<float>(1 << level)) / diagonal[i] * (rest[i] - w[i]);
      }
    }
    if (!stopped_.empty()) {
      for (std::size_t i = 0; i < kRow; ++i) {
        if ((l.stopped[begin + i] & (1 << axis)) != 0) r[i] = 0.0F;
      }
    }
  } else {
    if (state.row_held[row] != 0) {
      for (std::size_t i = 0; i < kRow; ++i) {
        if (state.role[begin + i] == Displacement::held) r[i] = 0.0F;
      }
    }
    if (state.row_obstacles[row] != 0) {
      // What an obstacle holds is balanced by it.
      const double touching = kTouching * lattice_.min_spacing_m();
      for (std::size_t i = 0; i < kRow; ++i) {
        const auto v = static_cast<VoxelId>(begin + i);
        if (state.role[v] == Displacement::obstacle && blocked(obstacles, state, v, touching)) r[i] = 0.0F;
      }
    }
    if (row_near_limits(springs, view, limits_[ua], kNearLimit, view.own)) {
      // What the chain holds is balanced by it. Passed on, its residual would drive the coarse levels
      // against links that do not give, and the sweeps after would undo it.
      for (std::size_t i = 0; i < kRow; ++i) {
        const auto v = static_cast<VoxelId>(begin + i);
        if (r[i] == 0.0F || !resisted(lattice_, state, axis, v, r[i])) continue;
        r[i] = 0.0F;
        stop_cells(v, static_cast<std::uint8_t>(1 << axis));
      }
    }
  }
  float worst = 0.0F;
  for (std::size_t i = 0; i < kRow; ++i) worst = std::max(worst, std::fabs(r[i]));
  return worst;
}

float Multigrid::restrict_loads(int level, RowId row, const Displacement& state,
                                const ObstacleView& obstacles) noexcept {
  Level& l = at(level);
  Level& below = at(level - 1);
  const std::size_t begin = static_cast<std::size_t>(row) * kRow;
  float worst = 0.0F;
  std::array<float, 8> row_worst{};
  for (int axis = 0; axis < 3; ++axis) {
    const auto ua = static_cast<std::size_t>(axis);
    Row sum, own;
    sum.fill(0.0F);
    for (int child = 0; child < 8; ++child) {
      RowId fine = 0;
      if (!rows_below(level, row, child, fine) || !below.couplings->prepare(fine)) continue;
      Row r;
      const float most = residual_of(level - 1, fine, axis, state, obstacles, r);
      // Of voxels as a force, of cells as a displacement, whose threshold is the same on all levels.
      const float* inverse = below.couplings->springs(fine, axis).inverse;
      const float way = level == 1 ? most / tolerance_N_ : row_weighted(r.data(), inverse) / quiet_m_;
      row_worst[static_cast<std::size_t>(child)] = std::max(row_worst[static_cast<std::size_t>(child)], way);
      worst = std::max(worst, most);
      add_pairs(r.data(), sum.data() + (child & 1) * kRow / 2);
    }
    row_pull(l.couplings->springs(row, axis), RowView(l.couplings->grid(), l.told[ua].data(), row),
             own.data());
    float* load = l.load[ua].data() + begin;
    for (std::size_t i = 0; i < kRow; ++i) load[i] = sum[i] - own[i];
  }
  for (int child = 0; child < 8; ++child) {
    RowId fine = 0;
    if (!rows_below(level, row, child, fine)) continue;
    if (row_worst[static_cast<std::size_t>(child)] < 1.0F) {
      unmark(level - 1, fine, active | dirty);
    } else {
      unmark(level - 1, fine, dirty);
      mark(level - 1, fine, active);
    }
  }
  spread(level, row, active | dirty);
  return worst;
}

void Multigrid::begin_telling(int level, RowId row) noexcept {
  Level& l = at(level);
  const std::size_t begin = static_cast<std::size_t>(row) * kRow;
  float most = 0.0F;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float* value = l.value[axis].data() + begin;
    float *told = l.told[axis].data() + begin, *telling = l.telling[axis].data() + begin;
    most = std::max(most, row_difference(value, told));
    for (std::size_t i = 0; i < kRow; ++i) telling[i] = value[i] - told[i];
  }
  unmark(level, row, changed | loud);
  if (most <= kPassedOn * quiet_m_) return;
  end_telling(level, row);
  mark(level, row, loud);
}

float Multigrid::untold(int level, RowId row) const noexcept {
  const Level& l = at(level);
  const std::size_t begin = static_cast<std::size_t>(row) * kRow;
  float most = 0.0F;
  for (std::size_t axis = 0; axis < 3; ++axis)
    most = std::max(most, row_difference(l.value[axis].data() + begin, l.told[axis].data() + begin));
  return most;
}

void Multigrid::end_telling(int level, RowId row) noexcept {
  Level& l = at(level);
  const std::size_t begin = static_cast<std::size_t>(row) * kRow;
  for (std::size_t axis = 0; axis < 3; ++axis)
    std::copy_n(l.value[axis].data() + begin, kRow, l.told[axis].data() + begin);
  unmark(level, row, changed);
}

// Cell-centred trilinear weights: 3/4 to the cell a voxel is in, 1/4 to the nearer neighbour, on each axis;
// an empty neighbour's share goes to the others (a free surface).
HYBRID_WIDE void Multigrid::interpolate(int level, RowId row, int axis, Of of, Row& out) noexcept {
  const auto ua = static_cast<std::size_t>(axis);
  Level& coarse = at(level + 1);
  const Grid& g = coarse.couplings->grid();
  const auto c = grid(level).row_coordinates(row);
  const int column = (c[0] - 1) / 2 + 1, half = (c[0] - 1) % 2 * (kRow / 2);
  const int own_j = c[1] / 2, own_k = c[2] / 2;
  const int near_j = (c[1] & 1) != 0 ? own_j + 1 : own_j - 1,
            near_k = (c[2] & 1) != 0 ? own_k + 1 : own_k - 1;
  static constexpr std::array<float, 4> kShare{0.5625F, 0.1875F, 0.1875F, 0.0625F};
  const std::array<RowId, 4> rows{g.row(column, own_j, own_k), g.row(column, near_j, own_k),
                                  g.row(column, own_j, near_k), g.row(column, near_j, near_k)};
  // Values and weights of the cells above this row, and of one more at both ends.
  constexpr int kCells = kRow / 2 + 2;
  std::array<float, kCells> value{}, weight{};
  for (std::size_t n = 0; n < 4; ++n) {
    const auto add = [&](RowId r, int first, int count, int to) {
      if (!coarse.couplings->prepare(r)) return;
      const float* filled = coarse.couplings->filled(r) + first;
      const std::size_t from = static_cast<std::size_t>(r) * kRow + static_cast<std::size_t>(first);
      const float *plus = nullptr, *minus = nullptr;
      if (of == Of::values) {
        plus = coarse.value[ua].data() + from;
      } else if (of == Of::set_aside) {
        if ((coarse.flags[r] & loud) != 0) plus = coarse.telling[ua].data() + from;
      } else if ((coarse.flags[r] & changed) != 0) {
        plus = coarse.value[ua].data() + from;
        minus = coarse.told[ua].data() + from;
      }
      for (int i = 0; i < count; ++i) {
        const float w = kShare[n] * filled[i];
        weight[static_cast<std::size_t>(to + i)] += w;
        if (plus == nullptr) continue;
        const float e = minus != nullptr ? plus[i] - minus[i] : plus[i];
        value[static_cast<std::size_t>(to + i)] += w * e;
      }
    };
    add(rows[n], half, kRow / 2, 1);
    if (half == 0) {
      add(rows[n] - g.row_x, kRow - 1, 1, 0);
      add(rows[n], kRow / 2, 1, kCells - 1);
    } else {
      add(rows[n], kRow / 2 - 1, 1, 0);
      add(rows[n] + g.row_x, 0, 1, kCells - 1);
    }
  }
  for (int i = 0; i < kRow; ++i) {
    const auto own = static_cast<std::size_t>(i / 2 + 1);
    const std::size_t near = (i & 1) != 0 ? own + 1 : own - 1;
    const float w = 0.75F * weight[own] + 0.25F * weight[near];
    const float v = 0.75F * value[own] + 0.25F * value[near];
    out[static_cast<std::size_t>(i)] = w > 0.0F ? v / w : 0.0F;
  }
}

// Adds a correction to one axis of a row, as far as its links allow.
void Multigrid::correct_voxels(RowId row, int axis, Row& correction, Displacement& state) noexcept {
  const auto ua = static_cast<std::size_t>(axis);
  float* u = state.u[ua].data();
  const std::size_t begin = static_cast<std::size_t>(row) * kRow;
  const RowSprings springs = at(0).couplings->springs(row, axis);
  for (std::size_t i = 0; i < kRow; ++i) {
    if (springs.inverse[i] == 0.0F) correction[i] = 0.0F;
  }
  if (state.row_held[row] != 0) {
    for (std::size_t i = 0; i < kRow; ++i) {
      if (state.role[begin + i] == Displacement::held) correction[i] = 0.0F;
    }
  }
  if (!stopped_.empty()) {
    // A voxel that pulls against a link at its limit stays, until the limit lets go of it.
    const std::uint8_t* stopped = at(0).stopped.data() + begin;
    for (std::size_t i = 0; i < kRow; ++i) {
      if ((stopped[i] & (1 << axis)) != 0) correction[i] = 0.0F;
    }
  }
  Row target;
  for (std::size_t i = 0; i < kRow; ++i) target[i] = u[begin + i] + correction[i];
  const RowView view(lattice_.grid(), u, row);
  if (!row_near_limits(springs, view, limits_[ua], kNearLimit, target.data())) {
    std::copy(target.begin(), target.end(), u + begin);
    return;
  }
  // Every second voxel at a time: beside neighbours that stand still, a limit is a plain interval.
  for (const int first : {0, 1}) {
    Row wanted = target;
    if (lattice_.uniform_limits()) {
      clamp_row(springs, view, limits_[ua], wanted.data());
    } else {
      for (std::size_t i = static_cast<std::size_t>(first); i < kRow; i += 2) {
        if (correction[i] == 0.0F) continue;
        const auto v = static_cast<VoxelId>(begin + i);
        wanted[i] = clamp_to(link_interval(lattice_, state, v, axis), wanted[i], u[v]);
      }
    }
    for (std::size_t i = 0; i < kRow; ++i) {
      if (correction[i] == 0.0F) wanted[i] = u[begin + i];
    }
    take_row(u + begin, wanted.data(), first);
  }
}

void Multigrid::prolong(int level, RowId row, bool now, Displacement& state,
                        const ObstacleView& obstacles) noexcept {
  const Level& coarse = at(level + 1);
  const Grid& g = coarse.couplings->grid();
  const auto c = grid(level).row_coordinates(row);
  const int column = (c[0] - 1) / 2 + 1, side = (c[0] - 1) % 2 == 0 ? -1 : 1;
  const int own_j = c[1] / 2, own_k = c[2] / 2;
  const int near_j = (c[1] & 1) != 0 ? own_j + 1 : own_j - 1,
            near_k = (c[2] & 1) != 0 ? own_k + 1 : own_k - 1;
  bool told = false;
  for (const int at_column : {column, column + side}) {
    for (const RowId r : {g.row(at_column, own_j, own_k), g.row(at_column, near_j, own_k),
                          g.row(at_column, own_j, near_k), g.row(at_column, near_j, near_k)}) {
      told = told || (coarse.flags[r] & (now ? changed : loud)) != 0;
    }
  }
  if (!told) return;
  float most = 0.0F;
  for (int axis = 0; axis < 3; ++axis) {
    Row correction;
    interpolate(level, row, axis, now ? Of::untold : Of::set_aside, correction);
    most = std::max(most, row_weighted(correction.data(), kOnes.data()));
    correct(level, row, axis, correction, state);
  }
  if (level == 0) clear_obstacles(row, state, obstacles);
  note_change(level, row, most);
}

void Multigrid::follow_coarse(int level, RowId row, Displacement& state,
                              const ObstacleView& obstacles) noexcept {
  float most = 0.0F;
  for (int axis = 0; axis < 3; ++axis) {
    Row correction;
    interpolate(level, row, axis, Of::values, correction);
    const float* own = values(level, axis, state) + static_cast<std::size_t>(row) * kRow;
    for (std::size_t i = 0; i < kRow; ++i) correction[i] -= own[i];
    most = std::max(most, row_weighted(correction.data(), kOnes.data()));
    correct(level, row, axis, correction, state);
  }
  if (level == 0) clear_obstacles(row, state, obstacles);
  note_change(level, row, most);
}

void Multigrid::correct(int level, RowId row, int axis, Row& correction, Displacement& state) noexcept {
  if (level == 0) {
    correct_voxels(row, axis, correction, state);
    return;
  }
  Level& l = at(level);
  const std::size_t begin = static_cast<std::size_t>(row) * kRow;
  const float* inverse = l.couplings->springs(row, axis).inverse;
  float* w = l.value[static_cast<std::size_t>(axis)].data() + begin;
  for (std::size_t i = 0; i < kRow; ++i) {
    const bool fixed = inverse[i] == 0.0F || (!stopped_.empty() && (l.stopped[begin + i] & (1 << axis)) != 0);
    if (!fixed) w[i] += correction[i];
  }
}

void Multigrid::clear_obstacles(RowId row, Displacement& state, const ObstacleView& obstacles) noexcept {
  if (obstacles.obstacles.empty() || state.row_obstacles[row] == 0) return;
  for (VoxelId v = row * kRow; v < (row + 1) * kRow; ++v) {
    if (state.role[v] == Displacement::obstacle) clear_obstacle(lattice_, state, obstacles, v);
  }
}

void Multigrid::copy_from(const Multigrid& other) noexcept {
  for (int l = 0; l < levels(); ++l) {
    Level& to = at(l);
    const Level& from = other.at(l);
    to.flags.copy_from(from.flags);
    to.plane_flags.copy_from(from.plane_flags);
    if (l == 0) continue;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      to.value[axis].copy_from(from.value[axis]);
      to.told[axis].copy_from(from.told[axis]);
      to.load[axis].copy_from(from.load[axis]);
    }
  }
}

std::size_t Multigrid::memory_bytes() const {
  std::size_t bytes = (held_.capacity() + stopped_.capacity()) * sizeof(HeldCell);
  for (const Level& l : levels_) {
    bytes += l.couplings->memory_bytes() + l.flags.resident_bytes() + l.plane_flags.resident_bytes() +
             l.stopped.resident_bytes() + l.held.resident_bytes() + l.row_held.resident_bytes();
    for (const auto* arrays : {&l.value, &l.told, &l.load, &l.telling}) {
      for (const auto& array : *arrays) bytes += array.resident_bytes();
    }
  }
  return bytes;
}

}  // namespace voxel::sparse
