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

// Of the spacing: if more than this is left of a row's motion, the row is tried again. Every contact at its
// limits leaves less in each result.
constexpr float kFollows = 0.01F;
// Turns in all, and turns in the tick that applies the rows near the contact.
constexpr int kTurns = 16, kTurnsAtOnce = 8;
constexpr std::size_t kRowBytes = kRow * sizeof(float);

}  // namespace

// Packs the change of a row. False if no voxel moved by more than `least_m` and no load of bricks changed;
// the caller drops the entry then.
bool ShadowObject::pack_row(RowId row, float least_m) noexcept {
  float* way = found_[1 - taking_].add(row);
  float most = 0.0F;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    most = std::max(
        most, row_way(state_.u[axis].data() + at(row), before_[axis].data() + at(row), way + axis * kRow));
  }
  const bool loads_changed = multigrid().bricks().take_changed(row);
  if (most <= least_m && !loads_changed) return false;
  // The same sum as the tick's, to the last bit.
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
    fetch_lines(state_.u[axis].data() + at(row), kRowBytes);
    fetch_lines(before_[axis].data() + at(row), kRowBytes);
  }
}

// Prefetches what apply_row() reads: lines that another core wrote, and rows that no cache kept since the
// last result. Rows that are applied together have most of their neighbours in the cache.
void ShadowObject::fetch_ahead(SoftObject& object, std::size_t n, bool together) const noexcept {
  if (n >= found_[taking_].count()) return;
  const RowId row = found_[taking_].row(n);
  const Grid& g = lattice_.grid();
  fetch_lines(found_[taking_].values(n), 3 * kRowBytes);
  for (const auto& axis : object.state_.u) {
    const float* u = axis.data();
    fetch_lines(u + at(row), kRowBytes);
    if (together) continue;
    for (const RowId r : {row - g.row_z, row - 1, row + 1, row + g.row_z}) fetch_lines(u + at(r), kRowBytes);
    fetch_lines(u + at(row - g.row_x) + kRow - 1, sizeof(float));
    fetch_lines(u + at(row + g.row_x), sizeof(float));
  }
  __builtin_prefetch(object.state_.role.data() + at(row));
  object.relaxation_.couplings().fetch_ahead(row);
}

// Reads the motion of the nth row of the result, or a part of it; that part is subtracted from what is left.
// Loads of bricks are copied.
void ShadowObject::way_of(SoftObject& object, std::size_t n, float part, RowVector& ways) noexcept {
  const RowId row = found_[taking_].row(n);
  float* way = found_[taking_].values(n);
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

// True if free voxels did not follow; what is left of their motion is in the result then.
bool ShadowObject::take_row(SoftObject& object, std::size_t n, float part) noexcept {
  Multigrid& to = object.relaxation_.multigrid();
  const RowId row = found_[taking_].row(n);
  float* way = found_[taking_].values(n);
  RowVector ways, wanted;
  way_of(object, n, part, ways);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float* there = object.state_.u[axis].data() + at(row);
    for (std::size_t i = 0; i < kRow; ++i) wanted[axis][i] = there[i] + ways[axis][i];
  }
  to.add(row, ways, object.state_, object.obstacle_view());
  object.note_moved(row);
  unsigned others = 0;  // all are counted: a search for the first took longer
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float* there = object.state_.u[axis].data() + at(row);
    for (std::size_t i = 0; i < kRow; ++i) others += wanted[axis][i] != there[i] ? 1U : 0U;
  }
  if (others == 0) return false;
  to.log().note(0, row);
  if (!in_turns_) return false;
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

// Applies rows first … last − 1 together: each goes as far as its links to the others' new places allow. Row
// by row, voxels that active limits tie together would not move. Without active limits rows do not obstruct
// one another, and one by one takes half the time.
void ShadowObject::take_limited_correction(SoftObject& object, std::size_t first, std::size_t last,
                                           float part) noexcept {
  Multigrid& to = object.relaxation_.multigrid();
  const bool whole = part == 1.0F;
  RowVector left;
  for (std::size_t n = first; n < last; ++n) {
    fetch_ahead(object, n + kAhead, true);
    const RowId row = found_[taking_].row(n);
    if (!to.can_join(row, object.state_)) continue;
    to.join(row, object.state_, [&](RowVector& ways) { way_of(object, n, part, ways); });
  }
  to.add_joined(object.state_);
  for (std::size_t n = first; n < last; ++n) {
    const RowId row = found_[taking_].row(n);
    // A part is rounded differently from what the shadow knows.
    if (!whole) to.log().note(0, row);
    bool gone = false;
    if (!to.joined(row, object.state_, left, gone)) {
      if (take_row(object, n, part) && whole) retry_.put(n);
      continue;
    }
    object.note_moved(row);
    if (gone) continue;
    to.log().note(0, row);
    if (!in_turns_ || !whole) continue;
    float* way = found_[taking_].values(n);
    float most = 0.0F;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (std::size_t i = 0; i < kRow; ++i) {
        way[axis * kRow + i] = left[axis][i];
        most = std::max(most, std::fabs(left[axis][i]));
      }
    }
    if (most > kFollows * static_cast<float>(lattice_.min_spacing_m())) retry_.put(n);
  }
  to.forget_joined();
}

void ShadowObject::take(SoftObject& object, int parts) noexcept {
  taking_ = 1 - taking_;
  take_parts(object);
  retry_.clear();
  in_turns_ = found_far_;
  together_ = found_far_ || found_limited_;
  drained_ = near_count_;
  parts_left_ = parts;
  // Loads of bricks are not split, so their motion is not.
  take_part(object, parts <= 1 || in_turns_ || lattice_.has_bricks());
}

// While parts are left, the same fraction of the submitted residual stays frozen. Both ends of the motion are
// at rest, and so is all between them as far as forces are linear.
void ShadowObject::take_part(SoftObject& object, bool last) noexcept {
  const int left = std::max(parts_left_, 1);
  const bool whole = last || left == 1;
  parts_left_ = whole ? 0 : left - 1;
  const float part = whole ? 1.0F : 1.0F / static_cast<float>(left);
  if (whole) {
    object.relaxation_.take_over(residual_N_);
  } else {
    object.keep_away(static_cast<float>(left - 1) / static_cast<float>(left));
  }
  if (together_) {
    take_limited_correction(object, 0, near_count_, part);
  } else {
    for (std::size_t n = 0; n < near_count_; ++n) {
      fetch_ahead(object, n + kAhead, false);
      // A part is rounded differently from what the shadow knows.
      if (left > 1) object.relaxation_.multigrid().log().note(0, found_[taking_].row(n));
      if (take_row(object, n, part) && whole) retry_.put(n);
    }
  }
  if (!whole) return;
  while (retry_.count() > 0 && retry_.turn() < kTurnsAtOnce)
    retry_.take(kTurns, [&](std::size_t n) { return take_row(object, n); });
  if (!at_rest_ || !drained()) object.relaxation_.wake();
}

void ShadowObject::drain(SoftObject& object, std::size_t rows) noexcept {
  if (in_turns_) {
    const std::size_t count = std::min(rows, found_[taking_].count() - drained_);
    if (count > 0) take_limited_correction(object, drained_, drained_ + count, 1.0F);
    drained_ += count;
    rows -= count;
  }
  for (; rows > 0 && drained_ < found_[taking_].count(); --rows, ++drained_) {
    fetch_ahead(object, drained_ + kAhead, false);
    if (take_row(object, drained_)) retry_.put(drained_);
  }
  for (; rows > 0 && retry_.count() > 0; --rows)
    retry_.take(kTurns, [&](std::size_t n) { return take_row(object, n); });
}

}  // namespace voxel
