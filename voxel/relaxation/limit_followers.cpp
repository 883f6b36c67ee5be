// SPDX-License-Identifier: GPL-3.0-or-later
// Finds the followers row by row, and moves each to its local equilibrium.
#include "voxel/relaxation/limit_followers.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "voxel/lattice/plastic_offsets.h"
#include "voxel/lattice/voxel_links.h"

namespace voxel {
namespace {

// Lanes of a row that are empty, anchored, or moved by another solver.
std::uint32_t staying(const Lattice& lattice, const Displacement& state, RowId row) {
  const std::size_t first = static_cast<std::size_t>(row) * kRow;
  const std::uint8_t* role = state.role.data() + first;
  std::uint32_t bits = ~lattice.filled_lanes(row) | lattice.anchored_lanes(row);
  for (std::size_t i = 0; i < kRow; ++i)
    bits |= static_cast<std::uint32_t>(role[i] != Displacement::free) << i;
  return bits;
}

// Limits b0 <= u(upper) − u(lower) <= b1 on axis kAxis of the link between a voxel and its neighbour above
// (kUp) or below along kD.
template <std::size_t kAxis, std::size_t kD, bool kUp>
std::array<float, 2> bounds_of(const RowLimits& limits, std::size_t lane) {
  if (limits.lanes == nullptr) {
    const AxisLimits& l = (*limits.of)[kAxis];
    return {l.low[kD], l.high[kD]};
  }
  const RowLimits::Written& w = *limits.lanes;
  if constexpr (kAxis == kD) {
    return {(kUp ? w.up_low : w.down_low)[kD][lane], (kUp ? w.up_high : w.down_high)[kD][lane]};
  } else {
    const float across = (kUp ? w.up_across : w.down_across)[kD][lane];
    return {-across, across};
  }
}

// Adds the forces of a voxel's links along kD to its load, and narrows its interval by their limits.
template <std::size_t kAxis, std::size_t kD>
void add_links(const RowStiffness& springs, const RowLimits& limits, std::size_t lane, float up, float down,
               float& pull, std::array<float, 2>& interval) {
  const std::size_t at = kD * kRow + lane;
  const float k_up = (kAxis == kD ? springs.up_along : springs.up_across)[at],
              k_down = (kAxis == kD ? springs.down_along : springs.down_across)[kD][lane];
  pull += k_up * up + k_down * down;
  const std::array<float, 2> above = bounds_of<kAxis, kD, true>(limits, lane),
                             below = bounds_of<kAxis, kD, false>(limits, lane);
  // If a row has one set of limits for all lanes, missing links have limits, too. A missing link is
  // recognised by its stiffness of 0.
  if (k_up > 0.0F) {
    interval[0] = std::max(interval[0], up - above[1]);
    interval[1] = std::min(interval[1], up - above[0]);
  }
  if (k_down > 0.0F) {
    interval[0] = std::max(interval[0], down + below[0]);
    interval[1] = std::min(interval[1], down + below[1]);
  }
}

}  // namespace

LimitFollowers::LimitFollowers(const Lattice& lattice, std::size_t most_sources)
    : lattice_(lattice), has_plasticity_(lattice.has_plasticity()), entry_(lattice.grid().rows()) {
  for (std::size_t d = 0; d < 3; ++d)
    spacing_m_[d] = static_cast<float>(lattice.spacing_m()[static_cast<int>(d)]);
  rows_.reserve(std::min(kMostRows, lattice.grid().rows()));
  followers_.reserve(most_sources + kMaxFollowers + 6);
}

// Null if the row is empty, or if too many rows were searched.
LimitFollowers::Row* LimitFollowers::look_at(RowId row) noexcept {
  if (entry_[row] != 0) return &rows_[entry_[row] - 1U];
  LevelStiffness& couplings = relaxation_->couplings();
  if (rows_.size() == rows_.capacity() || !couplings.prepare(row)) return nullptr;
  Row& out = rows_.emplace_back();
  entry_[row] = static_cast<std::uint16_t>(rows_.size());
  out.row = row;
  out.stays = out.closed = staying(lattice_, *state_, row);
  couplings.all(row, out.springs);
  out.limits = couplings.limits(row);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (state_->bricks.has(row))
      out.bricks[axis] = state_->bricks.load[axis].data() + static_cast<std::size_t>(row) * kRow;
    if (relaxation_->shadow_busy()) out.frozen[axis] = relaxation_->multigrid().frozen_load(row, axis);
  }
  return &out;
}

void LimitFollowers::move(Relaxation& relaxation, Displacement& state, std::span<const VoxelId> sources,
                          float mark_dirty) noexcept {
  relaxation_ = &relaxation;
  state_ = &state;
  mark_dirty_ = mark_dirty;
  for (const Row& r : rows_) entry_[r.row] = 0;
  rows_.clear();
  move_on<0>(sources);
  move_on<1>(sources);
  move_on<2>(sources);
}

template <std::size_t kAxis>
void LimitFollowers::move_on(std::span<const VoxelId> sources) noexcept {
  for (Row& r : rows_) r.closed = r.stays;
  followers_.clear();
  for (const VoxelId v : sources) {
    if (Row* row = look_at(v / kRow); row != nullptr) add(*row, v);
  }
  const std::size_t most = followers_.size() + kMaxFollowers;
  for (std::size_t head = 0; head < followers_.size() && followers_.size() < most; ++head) {
    const VoxelId v = followers_[head];
    visit<kAxis, 0, false>(v, lattice_.down(v, 0));
    visit<kAxis, 0, true>(v, lattice_.up(v, 0));
    visit<kAxis, 1, false>(v, lattice_.down(v, 1));
    visit<kAxis, 1, true>(v, lattice_.up(v, 1));
    visit<kAxis, 2, false>(v, lattice_.down(v, 2));
    visit<kAxis, 2, true>(v, lattice_.up(v, 2));
  }
}

// Visits voxel `at` from its neighbour `from`, which lies below `at` along kD (kUp) or above it.
template <std::size_t kAxis, std::size_t kD, bool kUp>
void LimitFollowers::visit(VoxelId from, VoxelId at) noexcept {
  Row* row = look_at(at / kRow);
  const std::size_t lane = at % kRow;
  if (row == nullptr || (row->closed >> lane & 1U) != 0) return;
  auto& u = state_->u[kAxis];
  const std::array<float, 2> b = bounds_of<kAxis, kD, !kUp>(row->limits, lane);
  const float low = kUp ? b[0] : -b[1], high = kUp ? b[1] : -b[0], before = u[at];
  const auto room = [&](float now) { return std::min(now - u[from] - low, high - (now - u[from])); };
  if (room(before) > kSearched * spacing_m_[kD]) return;
  const float place = local_equilibrium<kAxis>(*row, at);
  u[at] = place;
  if (!row->dirty && std::fabs(place - before) > mark_dirty_ * spacing_m_[kD]) {
    row->dirty = true;
    relaxation_->mark_dirty(row->row);
  }
  if (!row->noted) {
    row->noted = true;
    relaxation_->multigrid().log().note(0, row->row);
  }
  if (room(place) <= kAtLimit * spacing_m_[kD]) add(*row, at);
}

// Displacement of a voxel at its local equilibrium, with all others fixed.
template <std::size_t kAxis>
float LimitFollowers::local_equilibrium(const Row& row, VoxelId v) const noexcept {
  const std::size_t lane = v % kRow;
  const float* u = state_->u[kAxis].data();
  const auto at = [&](VoxelId w) { return u[w]; };
  float pull = row.bricks[kAxis] != nullptr ? row.bricks[kAxis][lane] : 0.0F;
  if (has_plasticity_)
    pull = plastic_load(lattice_, *state_, relaxation_->couplings().springs_of(v), v)[kAxis];
  constexpr float kFar = std::numeric_limits<float>::max();
  std::array<float, 2> interval{-kFar, kFar};
  add_links<kAxis, 0>(row.springs, row.limits, lane, at(lattice_.up(v, 0)), at(lattice_.down(v, 0)), pull,
                      interval);
  add_links<kAxis, 1>(row.springs, row.limits, lane, at(lattice_.up(v, 1)), at(lattice_.down(v, 1)), pull,
                      interval);
  add_links<kAxis, 2>(row.springs, row.limits, lane, at(lattice_.up(v, 2)), at(lattice_.down(v, 2)), pull,
                      interval);
  const float inverse = row.springs.inverse[kAxis * kRow + lane];
  auto wanted = static_cast<double>(pull * inverse);
  if (row.frozen[kAxis] != nullptr) {
    const float own = row.bricks[kAxis] != nullptr ? row.bricks[kAxis][lane] : 0.0F;
    wanted += static_cast<double>(inverse) * static_cast<double>(row.frozen[kAxis][lane] - own);
  }
  return clamp_to(interval, static_cast<float>(wanted), u[v]);
}

}  // namespace voxel
