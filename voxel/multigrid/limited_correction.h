// SPDX-License-Identifier: GPL-3.0-or-later
// One correction for many rows of voxels under the limits of their links: rows move together, each as far as
// the links to the others' new places allow.
//
// If rows moved one after another, links to rows that have not moved yet would stop them, and voxels that
// active limits tie together would not move. So all rows move first. Then voxels with a link beyond its limit
// come back towards their start until no link exceeds its limits. This always succeeds: at the start no link
// exceeded its limits, so one end of such a link can come nearer to its start. If all voxels move in the same
// direction on an axis, they come back by the least amount, whatever the order. (The reason is that the
// minimum and the maximum of two states within such limits are within them, too.)
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "voxel/lattice/lazy_array.h"
#include "voxel/lattice/row_grid.h"
#include "voxel/lattice/simd8.h"
#include "voxel/multigrid/row_smoother.h"

namespace voxel {

class LimitedCorrection {
 public:
  static constexpr std::size_t kMost = 65536;  // greatest number of rows at a time

  struct Row {
    RowId row = 0;
    LaneSpan span;
    float most_m = 0.0F;  // largest motion asked of it
    bool asked = false;   // it is queued
    bool out = false;     // it has moved
    bool cut = false;     // voxels that do not move were asked to move
    bool aims = false;    // its target is stored, because the row may miss it
    RowVector from;       // before it moves: its motion (m); afterwards: its old place (m)
  };

  LimitedCorrection() = default;
  // Reserves address space for `rows` rows of a grid; kMost at most are in use at a time.
  explicit LimitedCorrection(std::size_t rows);

  [[nodiscard]] bool full() const noexcept { return count_ == rows_.size(); }
  // Takes the memory now for `rows` rows, of which `some` do not reach their targets.
  void populate(std::size_t rows, std::size_t some) noexcept {
    rows_.populate(std::min(rows, rows_.size()), {true});
    aims_.populate(std::min(some, aims_.size()), {true});
    ring_.populate(std::min(some, ring_.size()), {true});
    number_.populate();
  }
  // Adds a row that was not added yet. Call only if not full(). The caller writes its motion to `from`; lanes
  // outside of the span do not move.
  Row& add(RowId row, LaneSpan span) noexcept;
  void clear() noexcept;
  // Target of a row (m); kept for rows that did not reach it.
  [[nodiscard]] RowVector& aim(const Row& row) noexcept { return aims_[index(row)]; }
  [[nodiscard]] const RowVector& aim(const Row& row) const noexcept { return aims_[index(row)]; }
  [[nodiscard]] std::span<Row> rows() noexcept { return {rows_.data(), count_}; }
  // Null: the row was not added.
  [[nodiscard]] const Row* find(RowId row) const noexcept {
    return number_[row] == 0 ? nullptr : &rows_[number_[row] - std::size_t{1}];
  }

  [[nodiscard]] bool has(RowId row) const noexcept { return number_[row] != 0; }

  // ---- a queue of rows ----
  // Queues a row that was added; ignores others.
  void ask(RowId row) noexcept;
  // The next row; null: none.
  [[nodiscard]] Row* next() noexcept;

  [[nodiscard]] std::size_t memory_bytes() const {
    return rows_.resident_bytes() + aims_.resident_bytes() + number_.resident_bytes() +
           ring_.resident_bytes();
  }

 private:
  [[nodiscard]] std::size_t index(const Row& row) const noexcept { return number_[row.row] - std::size_t{1}; }

  LazyArray<Row> rows_;
  LazyArray<RowVector> aims_;        // [index into rows_]
  LazyArray<std::uint32_t> number_;  // [row] 1 + index into rows_; 0: not added
  LazyArray<std::uint32_t> ring_;
  std::size_t count_ = 0, head_ = 0, tail_ = 0;
};

}  // namespace voxel
