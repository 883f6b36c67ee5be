// SPDX-License-Identifier: GPL-3.0-or-later
// Applying a result of asynchronous relaxation to the object: row by row, or many rows together, within the
// limits of their links.
#include "voxel/object/shadow_object.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "voxel/lattice/prefetch.h"

namespace voxel {

namespace {

// Fraction of the spacing. If more than this is left of a row's motion, the row is tried again. Smaller
// remainders occur in every result while a contact is at its limits.
constexpr float kFollows = 0.01F;
// Largest number of turns in which rows are tried again: in all, and in the tick that applies the rows near
// the contact.
constexpr int kTurns = 16, kTurnsAtOnce = 8;
constexpr std::size_t kRowBytes = kRow * sizeof(float);

}  // namespace

// Packs the change of a row. False if no voxel moved by more than `least_m` and no load of bricks changed;
// the caller drops the entry then.
bool ShadowObject::pack_row(RowId row, float least_m) noexcept {
  float* way = results_[1 - applying_].add(row);
  float most = 0.0F;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    most = std::max(
        most, row_way(state_.u[axis].data() + at(row), before_[axis].data() + at(row), way + axis * kRow));
  }
  const bool loads_changed = multigrid().bricks().take_changed(row);
  if (most <= least_m && !loads_changed) return false;
  // The tick computes the same sum when it applies the row. Both sums are equal to the last bit.
  for (std::size_t axis = 0; axis < 3; ++axis) {
    float* now = state_.u[axis].data() + at(row);
    float* was = before_[axis].data() + at(row);
    for (std::size_t i = 0; i < kRow; ++i) was[i] += way[axis * kRow + i];
    std::copy_n(was, kRow, now);
    if (state_.bricks.row.size() > 0)
      std::copy_n(state_.bricks.load[axis].data() + at(row), kRow, way + (3 + axis) * kRow);
  }
  return true;
}

void ShadowObject::fetch_change_ahead(RowId row) const noexcept {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    prefetch_range(state_.u[axis].data() + at(row), kRowBytes);
    prefetch_range(before_[axis].data() + at(row), kRowBytes);
  }
}

// Prefetches the data that apply_row() reads: cache lines that another core wrote, and rows that were evicted
// from the caches since the last result. Rows that are applied together have most of their neighbours in the
// cache.
void ShadowObject::fetch_ahead(SoftObject& object, std::size_t n, bool together) const noexcept {
  if (n >= results_[applying_].count()) return;
  const RowId row = results_[applying_].row(n);
  const Grid& g = lattice_.grid();
  prefetch_range(results_[applying_].values(n), 3 * kRowBytes);
  for (const auto& axis : object.state_.u) {
    const float* u = axis.data();
    prefetch_range(u + at(row), kRowBytes);
    if (together) continue;
    for (const RowId r : {row - g.row_z, row - 1, row + 1, row + g.row_z})
      prefetch_range(u + at(r), kRowBytes);
    prefetch_range(u + at(row - g.row_x) + kRow - 1, sizeof(float));
    prefetch_range(u + at(row + g.row_x), sizeof(float));
  }
  __builtin_prefetch(object.state_.role.data() + at(row));
  object.relaxation_.couplings().fetch_ahead(row);
}

// Reads `part` of the motion of the nth row of the result. If that is not all, the result keeps the rest.
// Loads of bricks are copied.
void ShadowObject::take_delta(SoftObject& object, std::size_t n, float part, RowVector& ways) noexcept {
  const RowId row = results_[applying_].row(n);
  float* way = results_[applying_].values(n);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < kRow; ++i) {
      ways[axis][i] = part * way[axis * kRow + i];
      if (part < 1.0F) way[axis * kRow + i] -= ways[axis][i];
    }
  }
  if (BrickLoad& bricks = object.state_.bricks; bricks.row.size() > 0) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      std::copy_n(way + (3 + axis) * kRow, kRow, bricks.load[axis].data() + at(row));
    bricks.row[row] = 1;
  }
}

// Applies `part` of the motion of the nth row. Returns true if voxels did not follow and the row should be
// tried again. The result then keeps the rest of their motion.
bool ShadowObject::apply_row(SoftObject& object, std::size_t n, float part) noexcept {
  Multigrid& to = object.relaxation_.multigrid();
  const RowId row = results_[applying_].row(n);
  float* way = results_[applying_].values(n);
  RowVector ways, wanted;
  take_delta(object, n, part, ways);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float* there = object.state_.u[axis].data() + at(row);
    for (std::size_t i = 0; i < kRow; ++i) wanted[axis][i] = there[i] + ways[axis][i];
  }
  to.add_motion(row, ways, object.state_, object.obstacle_view());
  object.note_moved(row);
  unsigned others = 0;  // counts all differences, which is faster than a search for one
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float* there = object.state_.u[axis].data() + at(row);
    for (std::size_t i = 0; i < kRow; ++i) others += wanted[axis][i] != there[i] ? 1U : 0U;
  }
  if (others == 0) return false;
  to.log().note(0, row);
  if (!retries_rows_) return false;
  float most = 0.0F;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float* there = object.state_.u[axis].data() + at(row);
    for (std::size_t i = 0; i < kRow; ++i) {
      const bool is_jammed = object.state_.role[at(row) + i] == Displacement::obstacle;
      const float left = is_jammed ? 0.0F : wanted[axis][i] - there[i];
      way[axis * kRow + i] = left;
      most = std::max(most, std::fabs(left));
    }
  }
  return most > kFollows * static_cast<float>(lattice_.min_spacing_m());
}

// Applies rows first … last − 1 together. Each row moves as far as its links to the other rows' new places
// allow. If rows were applied one by one, voxels that active limits tie together would not move. Without
// active limits rows do not obstruct one another, and applying them one by one takes half the time.
void ShadowObject::apply_together(SoftObject& object, std::size_t first, std::size_t last,
                                  float part) noexcept {
  Multigrid& to = object.relaxation_.multigrid();
  const bool whole = part == 1.0F;
  RowVector left;
  for (std::size_t n = first; n < last; ++n) {
    fetch_ahead(object, n + kAhead, true);
    const RowId row = results_[applying_].row(n);
    if (!to.can_batch(row, object.state_)) continue;
    to.batch(row, object.state_, [&](RowVector& ways) { take_delta(object, n, part, ways); });
  }
  to.move_batch(object.state_);
  for (std::size_t n = first; n < last; ++n) {
    const RowId row = results_[applying_].row(n);
    // A sum of parts is rounded differently from the shadow's values.
    if (!whole) to.log().note(0, row);
    bool gone = false;
    if (!to.batched(row, object.state_, left, gone)) {
      if (apply_row(object, n, part) && whole) retry_.put(n);
      continue;
    }
    object.note_moved(row);
    if (gone) continue;
    to.log().note(0, row);
    if (!retries_rows_ || !whole) continue;
    float* way = results_[applying_].values(n);
    float most = 0.0F;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (std::size_t i = 0; i < kRow; ++i) {
        way[axis * kRow + i] = left[axis][i];
        most = std::max(most, std::fabs(left[axis][i]));
      }
    }
    if (most > kFollows * static_cast<float>(lattice_.min_spacing_m())) retry_.put(n);
  }
  to.clear_batch();
}

void ShadowObject::apply_near(SoftObject& object, int parts) noexcept {
  applying_ = 1 - applying_;
  apply_block_moves(object);
  retry_.clear();
  retries_rows_ = large_motion_;
  together_ = large_motion_ || at_limits_;
  rows_applied_ = near_count_;
  parts_left_ = parts;
  // Loads of bricks are not split into parts. So the motion that belongs to them is not split either.
  apply_part(object, parts <= 1 || retries_rows_ || lattice_.has_bricks());
}

// A result is applied in equal parts. While a fraction of its motion is still to come, the same fraction of
// the submitted residual stays frozen. If the tissue is at rest before the first part and after the last, it
// is then at rest between parts, too, as far as forces are linear.
void ShadowObject::apply_part(SoftObject& object, bool last) noexcept {
  const int left = std::max(parts_left_, 1);
  const bool whole = last || left == 1;
  parts_left_ = whole ? 0 : left - 1;
  const float part = whole ? 1.0F : 1.0F / static_cast<float>(left);
  if (whole) {
    object.relaxation_.resume(residual_N_);
  } else {
    object.keep_frozen_residual(static_cast<float>(left - 1) / static_cast<float>(left));
  }
  if (together_) {
    apply_together(object, 0, near_count_, part);
  } else {
    for (std::size_t n = 0; n < near_count_; ++n) {
      fetch_ahead(object, n + kAhead, false);
      // A sum of parts is rounded differently from the shadow's values.
      if (left > 1) object.relaxation_.multigrid().log().note(0, results_[applying_].row(n));
      if (apply_row(object, n, part) && whole) retry_.put(n);
    }
  }
  if (!whole) return;
  while (retry_.count() > 0 && retry_.turn() < kTurnsAtOnce)
    retry_.retry(kTurns, [&](std::size_t n) { return apply_row(object, n); });
  if (!at_rest_ || !all_applied()) object.relaxation_.wake();
}

void ShadowObject::apply_far(SoftObject& object, std::size_t rows) noexcept {
  if (retries_rows_) {
    const std::size_t count = std::min(rows, results_[applying_].count() - rows_applied_);
    if (count > 0) apply_together(object, rows_applied_, rows_applied_ + count, 1.0F);
    rows_applied_ += count;
    rows -= count;
  }
  for (; rows > 0 && rows_applied_ < results_[applying_].count(); --rows, ++rows_applied_) {
    fetch_ahead(object, rows_applied_ + kAhead, false);
    if (apply_row(object, rows_applied_)) retry_.put(rows_applied_);
  }
  for (; rows > 0 && retry_.count() > 0; --rows)
    retry_.retry(kTurns, [&](std::size_t n) { return apply_row(object, n); });
}

}  // namespace voxel
