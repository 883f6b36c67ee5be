// SPDX-License-Identifier: GPL-3.0-or-later
// Rounds over the whole object: tiles, clusters, active limits, and whether the object is at rest.
#include "voxel/relaxation/relaxation.h"

#include <algorithm>
#include <cmath>

#include "voxel/relaxation/admm_region.h"

namespace voxel {

namespace {

constexpr std::uint64_t kLetGoEvery = 8;  // without gain, active limits are released once in this many rounds
constexpr int kPatience = 40;             // cycles without gain before an object counts as resting
// The factor of boundary springs, boundary_scale_, is at least 1. A round whose residual exceeds kWorse times
// that of the round before multiplies the factor by kHarder, to kHardest at most. Any other round, and the
// first one after wake(), multiplies it by kSofter.
constexpr double kWorse = 1.05;
constexpr float kHarder = 8.0F, kSofter = 0.97F, kHardest = 1e4F;
constexpr double kGain = 0.98;      // a residual below this share of the least one so far is a gain
constexpr double kNearRest = 10.0;  // (unit: tolerance) below this residual clusters at limits are moved
constexpr double kProgress = 1e-3;  // (unit: spacing) a cluster that moves further in a step is not at rest
// Replaces kProgress where links have next to no slack (unit: spacing). The object is not at rest if the mean
// motion of all clusters on an axis exceeds its previous maximum by this much in a round. This is not tested
// if obstacles touch the object: tissue squeezed between them would keep moving.
constexpr double kDrift = 2e-5;
// Number of voxels at active limits by which each round starts further on than the round before.
constexpr std::uint64_t kNextFirst = 7919;

}  // namespace

std::uint64_t Relaxation::relax_tile(Displacement& state, const ObstacleView& obstacles,
                                     std::size_t number) noexcept {
  const TileQueue::Tile t = multigrid_.tiles().tile(number);
  constexpr int kSide = TileQueue::kSide;
  lay_boxes({t.column * kRow, t.j * kSide, t.k * kSide},
            {(t.column + 1) * kRow - 1, (t.j + 1) * kSide - 1, (t.k + 1) * kSide - 1}, kNoContact, 0,
            Visits::once);
  cycle(state, obstacles, Look::all_rows);
  std::uint64_t updates = 0;
  for (const LevelBoxes& b : boxes_) {
    updates += static_cast<std::uint64_t>(b.smoothed.q1 - b.smoothed.q0 + 1) * kLanes *
               static_cast<std::uint64_t>(b.smoothed.j1 - b.smoothed.j0 + 1) *
               static_cast<std::uint64_t>(b.smoothed.k1 - b.smoothed.k0 + 1);
  }
  return 2 * updates;
}

bool Relaxation::relax_region(Displacement& state, const ObstacleView& obstacles,
                              std::span<const VoxelId> on_body) noexcept {
  if (on_body.empty()) {
    region_->skip(multigrid_);
    return false;
  }
  const double most_N = region_->relax(multigrid_, state, obstacles, on_body);
  if (most_N > tolerance_N_) wake();
  return region_->at_limits();
}

// Moves the clusters of all voxels that active limits hold (cluster_steps.h). Returns the largest force per
// voxel that moved a cluster (N). Each round begins with another voxel: the number of visited voxels is
// limited, and each voxel has to have its turn.
double Relaxation::step_clusters(Displacement& state, const ObstacleView& obstacles) noexcept {
  cluster_steps_.begin();
  double most_N = 0.0;
  std::array<double, 3> went{};
  int moves = 0;
  const auto move = [&](VoxelId v, int axis) {
    const float from = state.u[static_cast<std::size_t>(axis)][v];
    const double force = cluster_steps_.move(multigrid_, state, v, axis, 0.5 * tolerance_N_);
    if (force == 0.0) return;
    most_N = std::max(most_N, force);
    // Each step lowers the energy, but the force may fall only after many steps.
    const auto way = static_cast<double>(state.u[static_cast<std::size_t>(axis)][v] - from);
    went[static_cast<std::size_t>(axis)] += way;
    ++moves;
    if (std::fabs(way) > kProgress * lattice_.min_spacing_m())
      cycles_without_gain_ = std::min(cycles_without_gain_, kPatience / 2 + 1);
    for (const VoxelId w : cluster_steps_.moved()) multigrid_.mark_dirty(0, w / kRow);
  };
  // rigid blocks that limits hold
  for (std::size_t p = 0; multigrid_.has_blocks() && p < multigrid_.blocks().count(); ++p) {
    for (int axis = 0; axis < 3; ++axis) move(multigrid_.blocks().first(p), axis);
  }
  std::uint64_t count = 0;
  multigrid_.for_active([&count](VoxelId, int) { ++count; });
  const std::uint64_t first = count == 0 ? 0 : cycles_ * kNextFirst % count;
  for (const bool before : {false, true}) {
    std::uint64_t n = 0;
    multigrid_.for_active([&](VoxelId v, int axis) {
      if ((n++ < first) == before) move(v, axis);
    });
  }
  for (std::size_t axis = 0; axis < 3 && moves > 0 && obstacles.obstacles.empty(); ++axis) {
    drift_m_[axis] += went[axis] / moves;
    const double further = std::fabs(drift_m_[axis]) - furthest_m_[axis];
    if (further <= 0.0) continue;
    furthest_m_[axis] += further;
    if (further > kDrift * lattice_.min_spacing_m())
      cycles_without_gain_ = std::min(cycles_without_gain_, kPatience / 2 + 1);
  }
  credit_ -= static_cast<std::int64_t>(cluster_steps_.looked_at());
  return most_N;
}

// Ends a round over everything that moves, and decides whether the object is at rest.
void Relaxation::end_round(Displacement& state, const ObstacleView& obstacles, double residual_N) noexcept {
  residual_N = std::max(residual_N, static_cast<double>(multigrid_.bricks().unbalanced_N()));
  // Clusters move only when little else does. Between other corrections their steps would undo one another
  // and raise the energy.
  if (residual_N < kNearRest * tolerance_N_ || cycles_without_gain_ > kPatience / 2 ||
      multigrid_.has_blocks())
    residual_N = std::max(residual_N, step_clusters(state, obstacles));
  // Active limits are released in every round only while rounds gain. Otherwise two active sets could
  // alternate without end.
  //
  // AdmmRegion runs beside moving bodies, and under the tool. Under the tool it runs only in rounds that may
  // take longer than a tick, because it moves pressed voxels and all their dependents together. In both cases
  // only limits that no voxel pulls against are released. If the other limits were released, too, coarse
  // levels would move voxels off these limits and back. Beside fixed obstacles AdmmRegion is not used,
  // because the per-voxel contact solver would undo its result in each tick.
  if (obstacles.moving > 0 || (tool_presses_ && patient_ && obstacles.obstacles.empty())) {
    residual_N = std::max(residual_N, region_->relax(multigrid_, state, obstacles, {}));
    credit_ -= static_cast<std::int64_t>(region_->looked_at());
    multigrid_.release_inactive(state);
  } else {
    region_->forget(multigrid_);
    if (cycles_without_gain_ <= 1 || cycles_ % kLetGoEvery == 0) multigrid_.release_active();
  }
  // Held voxels that lie scattered fix their cells more firmly than their boundary springs do. Corrections of
  // coarse levels then go too far, and a round ends worse than the one before. Such a round raises the factor
  // of the boundary springs.
  if (residual_N > kWorse * residual_N_ && cycles_without_gain_ > 0) {
    boundary_scale_ = std::min(boundary_scale_ * kHarder, kHardest);
  } else {
    boundary_scale_ = std::max(1.0F, boundary_scale_ * kSofter);
  }
  multigrid_.set_boundary_scale(boundary_scale_);
  residual_N_ = residual_N;
  running_residual_N_ = 0.0;
  ++cycles_;
  if (cycles_without_gain_ == 0 || residual_N_ < kGain * least_residual_N_) {
    least_residual_N_ = residual_N_;
    cycles_without_gain_ = 0;
  }
  ++cycles_without_gain_;
  const bool at_rest =
      (residual_N_ < tolerance_N_ && multigrid_.bricks().round_ended()) || cycles_without_gain_ > kPatience;
  if (!at_rest) return;
  // At rest plastic offsets are committed. Then the object has to find a new rest.
  if (uncommitted_) {
    committing_ = true;
    uncommitted_ = false;
    commit_row_ = 0;
    return;
  }
  if (multigrid_.tiles().waiting() > 0 && cycles_without_gain_ <= kPatience) return;
  multigrid_.tiles().clear();
  asleep_ = true;
}

std::uint64_t Relaxation::commit_plastic_offsets(Displacement& state, std::uint64_t budget) noexcept {
  std::uint64_t spent = 0;
  const auto rows = static_cast<RowId>(lattice_.grid().rows());
  for (; commit_row_ < rows && spent < budget; ++commit_row_, ++spent) {
    if (state.plastic.row[commit_row_] == 0 || !multigrid_.prepare(0, commit_row_)) continue;
    multigrid_.update_plasticity(commit_row_, state, true);
    spent += kRow;
  }
  committing_ = commit_row_ < rows;
  return spent;
}

// True if a coarse cell above the tile has a pending correction.
bool Relaxation::tile_waits_for_coarse(std::size_t number) const noexcept {
  constexpr int kSide = TileQueue::kSide;
  const TileQueue::Tile t = multigrid_.tiles().tile(number);
  for (int level = 1; level < multigrid_.levels(); ++level) {
    const Grid& g = multigrid_.grid(level);
    const int column = (t.column >> level) + 1, rows = std::max(1, kSide >> level);
    const int j0 = t.j * kSide >> level, k0 = t.k * kSide >> level;
    for (int k = k0; k < std::min(k0 + rows, g.dims[2]); ++k) {
      for (int j = j0; j < std::min(j0 + rows, g.dims[1]); ++j) {
        const RowId row = g.row(column, j, k);
        if (multigrid_.has(level, row, Multigrid::changed) &&
            multigrid_.pending_correction(level, row) > multigrid_.motion_tolerance_m())
          return true;
      }
    }
  }
  return false;
}

}  // namespace voxel
