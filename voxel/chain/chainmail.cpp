// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/chain/chainmail.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace voxel {
namespace {

constexpr int kObstaclePasses = 8;  // corrections of voxels in obstacles, at most
// Margin of a wave (row_kernels.h), relative to the largest displacement of a source: 3.5 roundings of a
// float. Other roundings add to the violations that a wave leaves.
constexpr float kMargin = 2.1e-7F;

}  // namespace

ChainMail::ChainMail(const Lattice& lattice)
    : lattice_(lattice), wave_(lattice), raised_(lattice.voxel_count()), lowered_(lattice.voxel_count()) {
  stopped_.reserve(lattice.surface().size());
  stops_.reserve(lattice.surface().size());
}

float ChainMail::margin_of(const Displacement& state, int axis, std::span<const VoxelId> voxels,
                           std::span<const glm::vec3> moves) const noexcept {
  const LazyArray<float>& u = state.u[static_cast<std::size_t>(axis)];
  float largest = 0.0F;
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    if (moves[i][axis] == 0.0F) continue;
    largest = std::max({largest, std::fabs(u[voxels[i]]), std::fabs(u[voxels[i]] - moves[i][axis])});
  }
  return kMargin * largest;
}

void ChainMail::spread_moves(Displacement& state, std::span<const VoxelId> voxels,
                             std::span<const glm::vec3> moves) noexcept {
  for (int axis = 0; axis < 3; ++axis) {
    float* const u = state.u[static_cast<std::size_t>(axis)].data();
    float& margin = margin_[static_cast<std::size_t>(axis)];
    margin = std::max(margin, margin_of(state, axis, voxels, moves));
    std::size_t raised = 0, lowered = 0;
    for (std::size_t i = 0; i < voxels.size(); ++i) {
      const float move = moves[i][axis];
      const VoxelId v = voxels[i];
      if (move == 0.0F) continue;
      if (move > 0.0F)
        raised_[raised++] = {u[v], v};
      else
        lowered_[lowered++] = {u[v], v};
      u[v] -= move;  // back to a place without violation; the wave moves it again
    }
    // Axes share the budget. An axis passes the updates that it does not use to the next axis.
    const std::uint64_t share = std::max(kNearest, budget_left_ / static_cast<std::uint64_t>(3 - axis));
    const std::uint64_t used = wave_.spread(u, axis, Way::raise, {raised_.data(), raised}, margin, share);
    spend(used);
    spend(wave_.spread(u, axis, Way::lower, {lowered_.data(), lowered}, margin,
                       std::max(kNearest, share - std::min(share, used))));
  }
}

void ChainMail::spread_waiting(Displacement& state) noexcept {
  if (wave_.waiting_rows().empty() || budget_left_ == 0) return;
  wave_.take_waiting();
  for (int axis = 0; axis < 3; ++axis) {
    float* const u = state.u[static_cast<std::size_t>(axis)].data();
    const float margin = margin_[static_cast<std::size_t>(axis)];
    for (const Way way : {Way::raise, Way::lower}) {
      if (budget_left_ > 0) spend(wave_.spread_from_taken(u, axis, way, margin, budget_left_));
    }
  }
  wave_.put_back();
}

// Puts voxels that moved into their obstacles back onto the surface. True if there was any.
bool ChainMail::stop_at(Displacement& state, std::span<const Obstacle> obstacles, Stop stop) noexcept {
  stopped_.clear();
  stops_.clear();
  const double touching = kTouching * lattice_.min_spacing_m();
  for (const RowId row : wave_.moved_rows()) {
    if (state.row_obstacles[row] == 0) continue;
    for (VoxelId v = row * kRow; v < (row + 1) * kRow; ++v) {
      if (!Displacement::at_obstacle(state.role[v])) continue;
      const Obstacle& o = obstacles[lattice_.surface_number(v)];
      if (o.moving && stop == Stop::at_standing) continue;
      const glm::dvec3 n(o.normal), before = state.at(v);
      const double depth = static_cast<double>(o.bound) - glm::dot(n, before);
      if (depth <= touching) continue;
      stopped_by_moving_ = stopped_by_moving_ || o.moving;
      state.set(v, before + depth * n);
      stopped_.push_back(v);
      stops_.emplace_back(state.at(v) - before);
    }
  }
  return !stopped_.empty();
}

void ChainMail::settle(Displacement& state, std::span<const VoxelId> sources,
                       std::span<const glm::vec3> moves, std::span<const Obstacle> obstacles,
                       std::uint64_t budget) noexcept {
  wave_.begin();
  budget_left_ = budget;
  if (wave_.waiting_rows().empty()) margin_.fill(0.0F);
  for (const VoxelId v : sources) wave_.note_moved(v / kRow);
  // Neighbours follow the sources. Anchors stay; rows with pulled anchors are noted.
  spread_moves(state, sources, moves);
  enforce_obstacles_and_anchors(state, obstacles);
}

void ChainMail::finish(Displacement& state, std::span<const Obstacle> obstacles,
                       std::uint64_t budget) noexcept {
  wave_.begin();
  budget_left_ = budget;
  enforce_obstacles_and_anchors(state, obstacles);
}

void ChainMail::enforce_obstacles_and_anchors(Displacement& state,
                                              std::span<const Obstacle> obstacles) noexcept {
  spread_waiting(state);

  // Voxels that the wave pushed into obstacles are put back onto them, and the sources yield. An obstacle
  // with its normal along an axis needs one pass. The reason: undisplaced voxels are clear of all obstacles,
  // and the correction moves voxels back towards their undisplaced places. So it moves none into another
  // obstacle. A correction onto an oblique obstacle has components on other axes, too, and may need further
  // passes.
  bool clear = obstacles.empty();
  const auto stop = [&](Stop which) {
    for (int n = 0; n < kObstaclePasses && !clear; ++n) {
      clear = !stop_at(state, obstacles, which);
      if (!clear) spread_moves(state, stopped_, stops_);
    }
  };
  stopped_by_moving_ = false;
  stop(Stop::at_all);
  // Tissue squeezed between a moving and a standing obstacle stays out of the standing one.
  if (stopped_by_moving_) stop(Stop::at_standing);

  // Anchors are mutually feasible, so waves from the pulled ones leave no link violated.
  for (int axis = 0; axis < 3 && wave_.pulled_any(); ++axis) {
    float* const u = state.u[static_cast<std::size_t>(axis)].data();
    const float margin = margin_[static_cast<std::size_t>(axis)];
    for (const Way way : {Way::raise, Way::lower})
      spend(wave_.spread_from_pulled(u, axis, way, margin, std::max(kNearest, budget_left_)));
  }
}

std::size_t ChainMail::moved_count() const noexcept {
  std::size_t count = 0;
  for (const RowId row : moved_rows()) count += static_cast<std::size_t>(lattice_.filled_in(row));
  return count;
}

std::size_t ChainMail::memory_bytes() const {
  return wave_.memory_bytes() + raised_.resident_bytes() + lowered_.resident_bytes() +
         resident_bytes(stopped_) + resident_bytes(stops_);
}

double worst_violation(const Lattice& lattice, const Displacement& state) {
  double worst = 0.0;
  for (std::size_t i = 0; i < lattice.size(); ++i) {
    const auto v = static_cast<VoxelId>(i);
    if (!lattice.filled(v)) continue;
    for (int d = 0; d < 3; ++d) {
      const VoxelId w = lattice.up(v, d);
      if (!lattice.filled(w)) continue;
      for (int axis = 0; axis < 3; ++axis) {
        const auto b = lattice.bounds(v, d, axis);
        const auto& u = state.u[static_cast<std::size_t>(axis)];
        const double difference = static_cast<double>(u[w]) - static_cast<double>(u[v]);
        worst =
            std::max({worst, difference - static_cast<double>(b[1]), static_cast<double>(b[0]) - difference});
      }
    }
  }
  return worst;
}

}  // namespace voxel
