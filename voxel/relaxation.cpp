// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/relaxation.h"

#include <algorithm>
#include <cmath>

#include "voxel/wide.h"

namespace voxel {
namespace {

constexpr int kCoarsestSweeps = 8;
constexpr std::size_t kMaxLevels = 10;
constexpr double kTouching = 1e-6;  // of the spacing: nearer to its obstacle than this a voxel lies on it
constexpr int kPatience = 40;       // cycles without gain before an object counts as resting
constexpr double kGain = 0.98;      // of the least residual so far: less is a gain

VoxelId cell_at(const Springs& s, int i, int j, int k) {
  return static_cast<VoxelId>(static_cast<std::size_t>(i) + static_cast<std::size_t>(j) * s.stride[1] +
                              static_cast<std::size_t>(k) * s.stride[2]);
}
// Padded index of the cell that holds padded index i of the next finer level.
constexpr int parent(int i) {
  return (i + 1) / 2;
}

std::vector<std::uint64_t> costs_by_plane(const Springs& s) {
  std::vector<std::uint64_t> cost(static_cast<std::size_t>(s.dims[2]), 0);
  for (std::size_t row = 0; row < s.row.size(); ++row) {
    cost[row / static_cast<std::size_t>(s.dims[1])] +=
        static_cast<std::uint64_t>(s.row[row][1] - s.row[row][0]);
  }
  return cost;
}

}  // namespace

Relaxation::Relaxation(const Lattice& lattice)
    : lattice_(lattice), tolerance_N_(kRestingResidual * lattice.force_scale_N()) {
  std::vector<float> filled(lattice.size());
  std::vector<std::uint8_t> fixed(lattice.size());
  for (std::size_t v = 0; v < lattice.size(); ++v) {
    filled[v] = lattice.filled(static_cast<VoxelId>(v)) ? 1.0F : 0.0F;
    fixed[v] = lattice.anchored(static_cast<VoxelId>(v)) ? 1 : 0;
  }
  levels_.reserve(kMaxLevels);
  levels_.emplace_back();
  levels_[0].plane_cost = costs_by_plane(lattice.springs());
  while (levels_.size() < kMaxLevels) {
    const Springs& fine = springs(levels_.size() - 1);
    const bool small = *std::max_element(fine.dims.begin(), fine.dims.end()) <= 2 + 3;
    if (small && levels_.size() > 1) break;  // one coarse level at least: it is where residuals are measured
    Level coarse;
    std::vector<std::uint8_t> coarse_fixed;
    build_level(fine, filled, fixed, coarse, coarse_fixed);
    filled = coarse.filled;
    fixed = std::move(coarse_fixed);
    levels_.push_back(std::move(coarse));
  }

  const auto last = static_cast<std::uint8_t>(levels_.size() - 1);
  for (std::uint8_t level = 0; level < last; ++level) {
    steps_.push_back({Stage::smooth, level, 0});
    steps_.push_back({Stage::smooth, level, 1});
    steps_.push_back({Stage::restrict_residual, level, 0});
  }
  for (int n = 0; n < kCoarsestSweeps; ++n) {
    steps_.push_back({Stage::smooth, last, 0});
    steps_.push_back({Stage::smooth, last, 1});
  }
  for (int level = last - 1; level >= 0; --level) {
    steps_.push_back({Stage::prolong, static_cast<std::uint8_t>(level), 0});
    steps_.push_back({Stage::smooth, static_cast<std::uint8_t>(level), 1});
    steps_.push_back({Stage::smooth, static_cast<std::uint8_t>(level), 0});
  }
  for (const Step& step : steps_) {
    for (const std::uint64_t cost : levels_[step.level].plane_cost) {
      cycle_cost_ += step.stage == Stage::smooth ? (cost + 1) / 2 : cost;
    }
  }
  std::size_t longest = 0;
  for (std::size_t level = 0; level < levels_.size(); ++level) {
    longest = std::max(longest, static_cast<std::size_t>(springs(level).dims[0]) + 4);
  }
  scratch_.assign(longest, 0.0F);
  coarse_value_.assign(longest, 0.0F);
  coarse_weight_.assign(longest, 0.0F);
  at_limit_.assign(lattice.size(), 0);
  held_cells_.reserve(16384);
  unseen_.assign(lattice.springs().row.size(), 0);
  row_residual_.assign(lattice.springs().row.size(), 0.0F);
}

void Relaxation::stir(std::size_t row) noexcept {
  const auto across = static_cast<std::size_t>(lattice_.springs().dims[1]);
  // A filled row has a border row on every side, so no index leaves the array.
  unseen_[row] = unseen_[row - 1] = unseen_[row + 1] = unseen_[row - across] = unseen_[row + across] = 1;
}

void Relaxation::stir_all() noexcept {
  std::fill(unseen_.begin(), unseen_.end(), std::uint8_t{1});
}

void Relaxation::build_level(const Springs& fine, const std::vector<float>& fine_filled,
                             const std::vector<std::uint8_t>& fine_fixed, Level& coarse,
                             std::vector<std::uint8_t>& fixed) const {
  Springs& s = coarse.springs;
  std::size_t cells = 1;
  for (std::size_t d = 0; d < 3; ++d) {
    s.dims[d] = (fine.dims[d] - 1) / 2 + 2;
    cells *= static_cast<std::size_t>(s.dims[d]);
  }
  s.stride = {1, static_cast<std::size_t>(s.dims[0]),
              static_cast<std::size_t>(s.dims[0]) * static_cast<std::size_t>(s.dims[1])};
  s.row.assign(static_cast<std::size_t>(s.dims[1]) * static_cast<std::size_t>(s.dims[2]), {0, 0});
  coarse.filled.assign(cells, 0.0F);
  coarse.loud.assign(s.row.size(), 0);
  fixed.assign(cells, 0);
  for (std::size_t d = 0; d < 3; ++d) {
    s.along[d].assign(cells, 0.0F);
    s.across[d].assign(cells, 0.0F);
    s.inverse_diagonal[d].assign(cells, 0.0F);
    coarse.correction[d].assign(cells, 0.0F);
    coarse.residual[d].assign(cells, 0.0F);
  }
  for (int k = 1; k + 1 < fine.dims[2]; ++k) {
    for (int j = 1; j + 1 < fine.dims[1]; ++j) {
      for (int i = 1; i + 1 < fine.dims[0]; ++i) {
        const VoxelId v = cell_at(fine, i, j, k);
        if (fine_filled[v] == 0.0F) continue;
        const VoxelId cell = cell_at(s, parent(i), parent(j), parent(k));
        coarse.filled[cell] = 1.0F;
        // A cell with any anchor is held: an underestimate of the correction beside an anchor, never a wrong
        // one.
        if (fine_fixed[v] != 0) fixed[cell] = 1;
        const std::array<int, 3> c{i, j, k};
        for (std::size_t d = 0; d < 3; ++d) {
          if (parent(c[d] + 1) == parent(c[d])) continue;
          // A coarse link is as many fine links side by side as cross the face, each twice as long.
          s.along[d][cell] += 0.5F * fine.along[d][v];
          s.across[d][cell] += 0.5F * fine.across[d][v];
        }
      }
    }
  }
  for (int k = 1; k + 1 < s.dims[2]; ++k) {
    for (int j = 1; j + 1 < s.dims[1]; ++j) {
      auto& row = s.row[static_cast<std::size_t>(k) * static_cast<std::size_t>(s.dims[1]) +
                        static_cast<std::size_t>(j)];
      for (int i = 1; i + 1 < s.dims[0]; ++i) {
        const VoxelId v = cell_at(s, i, j, k);
        if (coarse.filled[v] == 0.0F) continue;
        if (row[1] == 0) row[0] = i;
        row[1] = i + 1;
        if (fixed[v] != 0) continue;
        for (int axis = 0; axis < 3; ++axis) {
          float sum = 0.0F;
          for (int d = 0; d < 3; ++d) {
            const float* stiffness = s.stiffness(axis, d);
            sum += stiffness[v] + stiffness[v - s.stride[static_cast<std::size_t>(d)]];
          }
          if (sum > 0.0F) s.inverse_diagonal[static_cast<std::size_t>(axis)][v] = 1.0F / sum;
        }
      }
    }
  }
  coarse.plane_cost = costs_by_plane(s);
}

int Relaxation::planes(const Step& step) const {
  // A restriction works on planes of the level it fills, so that each cell is summed at once.
  const std::size_t level = step.stage == Stage::restrict_residual ? step.level + std::size_t{1} : step.level;
  return springs(level).dims[2];
}

std::uint64_t Relaxation::run(Displacement& state, const ObstacleView& obstacles,
                              std::span<const VoxelId> held, std::uint64_t budget) noexcept {
  std::uint64_t spent = 0;
  while (!asleep_ && spent < budget) {
    if (step_ == 0 && plane_ == 1) begin_cycle(held);
    spent += do_plane(state, obstacles, steps_[step_], plane_) + 1;
    if (++plane_ + 1 < planes(steps_[step_])) continue;
    plane_ = 1;
    if (++step_ == steps_.size()) {
      step_ = 0;
      end_cycle();
    }
  }
  return spent;
}

void Relaxation::begin_cycle(std::span<const VoxelId> held) noexcept {
  running_residual_N_ = 0.0;
  // What the tool holds does not move in this cycle, nor does the cell around it on any coarser level.
  for (const VoxelId v : held) {
    auto c = lattice_.coordinates(v);
    for (std::size_t level = 1; level < levels_.size(); ++level) {
      for (int& x : c) x = parent(x);
      Springs& s = levels_[level].springs;
      const VoxelId cell = cell_at(s, c[0], c[1], c[2]);
      if (s.inverse_diagonal[0][cell] == 0.0F && s.inverse_diagonal[1][cell] == 0.0F &&
          s.inverse_diagonal[2][cell] == 0.0F) {
        break;  // held already, and so are the cells above it
      }
      if (held_cells_.size() == held_cells_.capacity())
        return;  // the rest moves a little with the correction
      held_cells_.push_back(
          {static_cast<std::uint8_t>(level),
           cell,
           {s.inverse_diagonal[0][cell], s.inverse_diagonal[1][cell], s.inverse_diagonal[2][cell]}});
      for (auto& inverse : s.inverse_diagonal) inverse[cell] = 0.0F;
    }
  }
}

// On one axis, the cells around v on all coarser levels do not move in this cycle.
void Relaxation::hold_cells(VoxelId v, int axis) noexcept {
  auto c = lattice_.coordinates(v);
  for (std::size_t level = 1; level < levels_.size(); ++level) {
    for (int& x : c) x = parent(x);
    Springs& s = levels_[level].springs;
    const VoxelId cell = cell_at(s, c[0], c[1], c[2]);
    float& inverse = s.inverse_diagonal[static_cast<std::size_t>(axis)][cell];
    if (inverse == 0.0F || held_cells_.size() == held_cells_.capacity()) return;
    held_cells_.push_back(
        {static_cast<std::uint8_t>(level),
         cell,
         {s.inverse_diagonal[0][cell], s.inverse_diagonal[1][cell], s.inverse_diagonal[2][cell]}});
    inverse = 0.0F;
  }
}

void Relaxation::end_cycle() noexcept {
  // Last first: a cell may have been held on one axis, then on another.
  for (auto held = held_cells_.rbegin(); held != held_cells_.rend(); ++held) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      levels_[held->level].springs.inverse_diagonal[axis][held->cell] = held->inverse_diagonal[axis];
    }
  }
  held_cells_.clear();
  residual_N_ = running_residual_N_;
  ++cycles_;
  if (cycles_without_gain_ == 0 || residual_N_ < kGain * least_residual_N_) {
    least_residual_N_ = residual_N_;
    cycles_without_gain_ = 0;
  }
  ++cycles_without_gain_;
  if (residual_N_ < tolerance_N_ || cycles_without_gain_ > kPatience) asleep_ = true;
}

std::uint64_t Relaxation::do_plane(Displacement& state, const ObstacleView& obstacles, const Step& step,
                                   int plane) noexcept {
  const std::size_t level = step.level;
  const std::size_t at = static_cast<std::size_t>(plane);
  switch (step.stage) {
    case Stage::smooth:
      if (level == 0) return smooth_lattice(state, obstacles, step.colour, plane);
      smooth_coarse(levels_[level], step.colour, plane);
      return (levels_[level].plane_cost[at] + 1) / 2;
    case Stage::restrict_residual:
      if (level == 0) return restrict_from_lattice(state, obstacles, plane);
      restrict_from_level(level, plane);
      return 4 * levels_[level + 1].plane_cost[at];
    case Stage::prolong:
      if (level == 0) return prolong_to_lattice(state, obstacles, plane);
      prolong_to_level(level, plane);
      return levels_[level].plane_cost[at];
  }
  return 0;
}

std::uint64_t Relaxation::smooth_lattice(Displacement& state, const ObstacleView& obstacles, int colour,
                                         int plane) noexcept {
  const Springs& s = lattice_.springs();
  const auto tolerance = static_cast<float>(tolerance_N_);
  std::uint64_t spent = 0;
  for (int j = 1 + ((plane + 1 + colour) & 1); j + 1 < s.dims[1]; j += 2) {
    const std::size_t row =
        static_cast<std::size_t>(plane) * static_cast<std::size_t>(s.dims[1]) + static_cast<std::size_t>(j);
    if (s.row[row][1] <= s.row[row][0] || (unseen_[row] == 0 && row_residual_[row] < tolerance)) continue;
    relax_row(lattice_, state, obstacles, row, s.row[row][0], s.row[row][1]);
    stir(row);
    spent += static_cast<std::uint64_t>(s.row[row][1] - s.row[row][0]);
  }
  return spent;
}

HYBRID_WIDE void Relaxation::smooth_coarse(Level& level, int colour, int plane) noexcept {
  const Springs& s = level.springs;
  const auto sy = static_cast<std::ptrdiff_t>(s.stride[1]), sz = static_cast<std::ptrdiff_t>(s.stride[2]);
  // A correction below this changes no residual by more than the tolerance.
  const auto quiet = static_cast<float>(tolerance_N_ / lattice_.force_scale_N() * lattice_.min_spacing_m());
  for (int j = 1 + ((plane + 1 + colour) & 1); j + 1 < s.dims[1]; j += 2) {
    const std::size_t row =
        static_cast<std::size_t>(plane) * static_cast<std::size_t>(s.dims[1]) + static_cast<std::size_t>(j);
    const int count = s.row[row][1] - s.row[row][0];
    if (count <= 0) continue;
    const std::size_t begin =
        row * static_cast<std::size_t>(s.dims[0]) + static_cast<std::size_t>(s.row[row][0]);
    int loud = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const auto ua = static_cast<std::size_t>(axis);
      float* e = level.correction[ua].data() + begin;
      const float *r = level.residual[ua].data() + begin, *inverse = s.inverse_diagonal[ua].data() + begin;
      const float *kx = s.stiffness(axis, 0) + begin, *ky = s.stiffness(axis, 1) + begin,
                  *kz = s.stiffness(axis, 2) + begin;
      float* next = scratch_.data();
      for (int i = 0; i < count; ++i) {
        next[i] = (r[i] + kx[i - 1] * e[i - 1] + kx[i] * e[i + 1] + ky[i - sy] * e[i - sy] +
                   ky[i] * e[i + sy] + kz[i - sz] * e[i - sz] + kz[i] * e[i + sz]) *
                  inverse[i];
        loud |= static_cast<int>(next[i] > quiet) | static_cast<int>(next[i] < -quiet);
      }
      std::copy_n(next, count, e);
    }
    level.loud[row] = static_cast<std::uint8_t>(loud);
  }
}

HYBRID_WIDE std::uint64_t Relaxation::restrict_from_lattice(const Displacement& state,
                                                            const ObstacleView& obstacles,
                                                            int plane) noexcept {
  const Springs& s = lattice_.springs();
  Level& coarse = levels_[1];
  const auto sy = static_cast<std::ptrdiff_t>(s.stride[1]), sz = static_cast<std::ptrdiff_t>(s.stride[2]);
  const auto coarse_plane =
      static_cast<std::ptrdiff_t>(static_cast<std::size_t>(plane) * coarse.springs.stride[2]);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::fill_n(coarse.residual[axis].begin() + coarse_plane, coarse.springs.stride[2], 0.0F);
    std::fill_n(coarse.correction[axis].begin() + coarse_plane, coarse.springs.stride[2], 0.0F);
  }
  const double touching = kTouching * lattice_.min_spacing_m();
  std::uint64_t spent = 0;
  for (int k = 2 * plane - 1; k <= std::min(2 * plane, s.dims[2] - 2); ++k) {
    for (int j = 1; j + 1 < s.dims[1]; ++j) {
      const std::size_t row =
          static_cast<std::size_t>(k) * static_cast<std::size_t>(s.dims[1]) + static_cast<std::size_t>(j);
      const int first = s.row[row][0], count = s.row[row][1] - first;
      if (count <= 0 || unseen_[row] == 0) continue;  // unchanged, and small: nothing to pass on
      unseen_[row] = 0;
      float worst = 0.0F;
      const std::size_t begin = row * static_cast<std::size_t>(s.dims[0]) + static_cast<std::size_t>(first);
      const std::uint8_t* role = state.role.data() + begin;
      std::fill_n(at_limit_.begin() + static_cast<std::ptrdiff_t>(begin), count, std::uint8_t{0});
      for (int axis = 0; axis < 3; ++axis) {
        const auto ua = static_cast<std::size_t>(axis);
        const float* u = state.u[ua].data() + begin;
        const float* inverse = s.inverse_diagonal[ua].data() + begin;
        const float *kx = s.stiffness(axis, 0) + begin, *ky = s.stiffness(axis, 1) + begin,
                    *kz = s.stiffness(axis, 2) + begin;
        float* r = scratch_.data();
        for (int i = 0; i < count; ++i) {
          const float pull = kx[i - 1] * (u[i - 1] - u[i]) + kx[i] * (u[i + 1] - u[i]) +
                             ky[i - sy] * (u[i - sy] - u[i]) + ky[i] * (u[i + sy] - u[i]) +
                             kz[i - sz] * (u[i - sz] - u[i]) + kz[i] * (u[i + sz] - u[i]);
          // Only what may move passes its residual on.
          r[i] = inverse[i] != 0.0F && role[i] != Displacement::held ? pull : 0.0F;
        }
        if (state.row_obstacles[row] != 0) {
          // What an obstacle holds is balanced by it.
          for (int i = 0; i < count; ++i) {
            const bool held_by_it =
                role[i] == Displacement::obstacle &&
                blocked(obstacles, state, static_cast<VoxelId>(begin) + static_cast<VoxelId>(i), touching);
            if (held_by_it) r[i] = 0.0F;
          }
        }
        if (near_limits(lattice_, state, axis, begin, count)) {
          // What the chain holds is balanced by it. Passed on, its residual would drive the coarse levels
          // against links that do not give, and the sweeps after would undo it: a cycle that ends where it
          // began, far from equilibrium.
          for (int i = 0; i < count; ++i) {
            const VoxelId v = static_cast<VoxelId>(begin) + static_cast<VoxelId>(i);
            if (r[i] == 0.0F || !resisted(lattice_, state, axis, v, r[i])) continue;
            r[i] = 0.0F;
            at_limit_[v] |= static_cast<std::uint8_t>(1 << axis);
            hold_cells(v, axis);
          }
        }
        float* target = coarse.residual[ua].data() + cell_at(coarse.springs, 0, parent(j), plane);
        for (int i = 0; i < count; ++i) {
          worst = std::max(worst, std::fabs(r[i]));
          target[parent(first + i)] += r[i];  // two neighbours share a cell
        }
      }
      row_residual_[row] = worst;
      running_residual_N_ = std::max(running_residual_N_, static_cast<double>(worst));
      spent += static_cast<std::uint64_t>(count);
    }
  }
  return spent;
}

void Relaxation::restrict_from_level(std::size_t fine, int plane) noexcept {
  const Level& level = levels_[fine];
  Level& coarse = levels_[fine + 1];
  const Springs& s = level.springs;
  const std::size_t coarse_plane = static_cast<std::size_t>(plane) * coarse.springs.stride[2];
  for (int axis = 0; axis < 3; ++axis) {
    const auto ua = static_cast<std::size_t>(axis);
    std::fill_n(coarse.residual[ua].begin() + static_cast<std::ptrdiff_t>(coarse_plane),
                coarse.springs.stride[2], 0.0F);
    std::fill_n(coarse.correction[ua].begin() + static_cast<std::ptrdiff_t>(coarse_plane),
                coarse.springs.stride[2], 0.0F);
    const auto& e = level.correction[ua];
    const float *kx = s.stiffness(axis, 0), *ky = s.stiffness(axis, 1), *kz = s.stiffness(axis, 2);
    for (int k = 2 * plane - 1; k <= std::min(2 * plane, s.dims[2] - 2); ++k) {
      for (int j = 1; j + 1 < s.dims[1]; ++j) {
        const std::size_t row =
            static_cast<std::size_t>(k) * static_cast<std::size_t>(s.dims[1]) + static_cast<std::size_t>(j);
        for (int i = s.row[row][0]; i < s.row[row][1]; ++i) {
          const std::size_t v = row * static_cast<std::size_t>(s.dims[0]) + static_cast<std::size_t>(i);
          if (s.inverse_diagonal[ua][v] == 0.0F) continue;
          const float pull =
              kx[v - 1] * (e[v - 1] - e[v]) + kx[v] * (e[v + 1] - e[v]) +
              ky[v - s.stride[1]] * (e[v - s.stride[1]] - e[v]) + ky[v] * (e[v + s.stride[1]] - e[v]) +
              kz[v - s.stride[2]] * (e[v - s.stride[2]] - e[v]) + kz[v] * (e[v + s.stride[2]] - e[v]);
          coarse.residual[ua][cell_at(coarse.springs, parent(i), parent(j), plane)] +=
              level.residual[ua][v] + pull;
        }
      }
    }
  }
}

HYBRID_WIDE void Relaxation::interpolate_row(const Level& coarse, int axis, int j, int k, int first,
                                             int last) noexcept {
  // Cell-centred trilinear weights: 3/4 to the cell a voxel is in, 1/4 to the nearer neighbour, on each axis;
  // an empty neighbour's share goes to the others (a free surface).
  const Springs& s = coarse.springs;
  const auto& e = coarse.correction[static_cast<std::size_t>(axis)];
  const int own_j = parent(j), own_k = parent(k);
  const int near_j = (j & 1) != 0 ? own_j - 1 : own_j + 1, near_k = (k & 1) != 0 ? own_k - 1 : own_k + 1;
  const std::array<std::size_t, 4> rows{cell_at(s, 0, own_j, own_k), cell_at(s, 0, near_j, own_k),
                                        cell_at(s, 0, own_j, near_k), cell_at(s, 0, near_j, near_k)};
  const int from = parent(first) - 1, to = std::min(parent(last - 1) + 2, s.dims[0]);
  for (int c = from; c < to; ++c) {
    const auto x = static_cast<std::size_t>(c);
    const float w0 = 0.5625F * coarse.filled[rows[0] + x], w1 = 0.1875F * coarse.filled[rows[1] + x],
                w2 = 0.1875F * coarse.filled[rows[2] + x], w3 = 0.0625F * coarse.filled[rows[3] + x];
    coarse_weight_[x] = w0 + w1 + w2 + w3;
    coarse_value_[x] = w0 * e[rows[0] + x] + w1 * e[rows[1] + x] + w2 * e[rows[2] + x] + w3 * e[rows[3] + x];
  }
  for (int i = first; i < last; ++i) {
    const auto own = static_cast<std::size_t>(parent(i));
    const std::size_t near = (i & 1) != 0 ? own - 1 : own + 1;
    const float weight = 0.75F * coarse_weight_[own] + 0.25F * coarse_weight_[near];
    const float value = 0.75F * coarse_value_[own] + 0.25F * coarse_value_[near];
    scratch_[static_cast<std::size_t>(i - first)] = weight > 0.0F ? value / weight : 0.0F;
  }
}

bool Relaxation::negligible(const Level& coarse, int j, int k) const noexcept {
  const auto across = static_cast<std::size_t>(coarse.springs.dims[1]);
  const auto own_j = static_cast<std::size_t>(parent(j)), own_k = static_cast<std::size_t>(parent(k));
  const std::size_t near_j = (j & 1) != 0 ? own_j - 1 : own_j + 1,
                    near_k = (k & 1) != 0 ? own_k - 1 : own_k + 1;
  return (coarse.loud[own_k * across + own_j] | coarse.loud[own_k * across + near_j] |
          coarse.loud[near_k * across + own_j] | coarse.loud[near_k * across + near_j]) == 0;
}

std::uint64_t Relaxation::prolong_to_lattice(Displacement& state, const ObstacleView& obstacles,
                                             int plane) noexcept {
  const Springs& s = lattice_.springs();
  std::uint64_t spent = 0;
  for (int j = 1; j + 1 < s.dims[1]; ++j) {
    const std::size_t row =
        static_cast<std::size_t>(plane) * static_cast<std::size_t>(s.dims[1]) + static_cast<std::size_t>(j);
    const int first = s.row[row][0], last = s.row[row][1];
    if (last <= first) continue;
    ++spent;
    if (negligible(levels_[1], j, plane)) continue;
    const std::size_t begin = row * static_cast<std::size_t>(s.dims[0]) + static_cast<std::size_t>(first);
    for (int axis = 0; axis < 3; ++axis) {
      interpolate_row(levels_[1], axis, j, plane, first, last);
      for (int i = 0; i < last - first; ++i) {
        if ((at_limit_[begin + static_cast<std::size_t>(i)] >> axis & 1) != 0)
          scratch_[static_cast<std::size_t>(i)] = 0.0F;
      }
      correct_row(lattice_, state, axis, begin, last - first, scratch_.data());
    }
    if (state.row_obstacles[row] != 0) clear_obstacles(lattice_, state, obstacles, begin, last - first);
    stir(row);
    spent += static_cast<std::uint64_t>(last - first);
  }
  return spent;
}

void Relaxation::prolong_to_level(std::size_t fine, int plane) noexcept {
  Level& level = levels_[fine];
  const Springs& s = level.springs;
  for (int j = 1; j + 1 < s.dims[1]; ++j) {
    const std::size_t row =
        static_cast<std::size_t>(plane) * static_cast<std::size_t>(s.dims[1]) + static_cast<std::size_t>(j);
    const int first = s.row[row][0], last = s.row[row][1];
    if (last <= first) continue;
    for (int axis = 0; axis < 3; ++axis) {
      interpolate_row(levels_[fine + 1], axis, j, plane, first, last);
      auto& e = level.correction[static_cast<std::size_t>(axis)];
      const auto& inverse = s.inverse_diagonal[static_cast<std::size_t>(axis)];
      for (int i = first; i < last; ++i) {
        const std::size_t v = row * static_cast<std::size_t>(s.dims[0]) + static_cast<std::size_t>(i);
        if (inverse[v] != 0.0F) e[v] += scratch_[static_cast<std::size_t>(i - first)];
      }
    }
  }
}

std::size_t Relaxation::memory_bytes() const {
  std::size_t bytes = 0;
  for (std::size_t level = 1; level < levels_.size(); ++level)
    bytes += levels_[level].filled.size() * 16 * sizeof(float);
  return bytes + held_cells_.capacity() * sizeof(HeldCell);
}

}  // namespace voxel
