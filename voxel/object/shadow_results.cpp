// SPDX-License-Identifier: GPL-3.0-or-later
// Applying the results of asynchronous relaxation to the object: row by row, within the limits of its links.
#include "voxel/object/shadow_object.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "voxel/lattice/prefetch.h"

namespace voxel {

namespace {

// What a row cannot follow waits for its next turn where that is more than this of the spacing; less is what
// any contact at its limits has in every result.
constexpr float kFollows = 0.01F;
// Turns in all, and of what is near the contact at once: with 4 and 2 the force was 43 % off after four
// results of a jump, with 8 and 4 by 2 %, with these after three.
constexpr int kTurns = 16, kTurnsAtOnce = 8;
constexpr std::size_t kRowBytes = kRow * sizeof(float);

}  // namespace

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

// Has what take_row() reads fetched while the rows before are added: what another core wrote, and rows that
// no cache has kept since the last result. With nothing else on the machine that is where they are, and it
// gains nothing; in real time a row takes 0.33 us in place of 0.54. (Of rows that are added together most
// neighbours just were: what stands around is not fetched for them.)
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

// Where the nth row of the parcel is to go, or a part of it, which is then left less.
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

// True where free voxels did not follow; then what is left stands in the parcel.
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
  unsigned others = 0;  // all are counted: sought one by one, the first of them took longer than it spares
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

// The rows first … before last of the parcel, each as far as its links to the others let it where those go.
// (One after the other, what limits tie together stayed where it was. Where no limit holds there is nothing
// in the way, and each by itself takes half as long.)
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
    // By parts it is rounded otherwise than the other thread knows it.
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
  // Loads of bricks come whole, so their ways do.
  take_part(object, parts <= 1 || in_turns_ || lattice_.has_bricks());
}

// While parts are left, as much of what was given counts as balanced as has not come yet: the two ends of a
// way are both at rest, and where forces are linear so is what lies between.
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
      // By parts it is rounded otherwise than the other thread knows it.
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
