// SPDX-License-Identifier: GPL-3.0-or-later
// Rows of voxels that are to move together, each as far as links to the others let it where those go.
//
// One after the other rows are in one another's way: each goes no further than its links to those that have
// not gone yet let it, and what limits tie together does not go at all. So all go at once, and what is beyond
// its limits then comes back towards where it was, until nothing is: where all were, nothing was beyond, so
// one of a link's two ends can always come nearer to it, and what comes back never turns round. What links
// allow is closed under least and most, so that where all on an axis go the same way the least that must does
// come back, whatever the order. (ProlongedBox row by row, twice, a cone of tissue at its limits that was to
// open by seven spacings opened by 0.6 in a cycle.)
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
  static constexpr std::size_t kMost = 65536;  // rows at a time

  struct Row {
    RowId row = 0;
    LaneSpan span;
    float most_m = 0.0F;  // that any of it was asked to move
    bool asked = false;   // stands in the queue
    bool out = false;     // has set out
    bool cut = false;     // some that do not move were to
    bool aims = false;    // its aim is not where it is
    RowVector from;       // where it was; before it sets out, its way (m)
  };

  LimitedCorrection() = default;
  // Address space for `rows` of a grid, of which kMost at most are in it at a time.
  explicit LimitedCorrection(std::size_t rows);

  [[nodiscard]] bool full() const noexcept { return count_ == rows_.size(); }
  // Takes the memory now of so many rows, some of which do not get where they are to go.
  void populate(std::size_t rows, std::size_t some) noexcept {
    rows_.populate(std::min(rows, rows_.size()), {true});
    aims_.populate(std::min(some, aims_.size()), {true});
    ring_.populate(std::min(some, ring_.size()), {true});
    number_.populate();
  }
  // Its way, of which the lanes in the span are gone, is to be written to `from`. Once a row, while it is not
  // full.
  Row& add(RowId row, LaneSpan span) noexcept;
  void clear() noexcept;
  // Where a row is to go, which is kept only of those that did not get there (m).
  [[nodiscard]] RowVector& aim(const Row& row) noexcept { return aims_[index(row)]; }
  [[nodiscard]] const RowVector& aim(const Row& row) const noexcept { return aims_[index(row)]; }
  [[nodiscard]] std::span<Row> rows() noexcept { return {rows_.data(), count_}; }
  // Null: it is not in there.
  [[nodiscard]] const Row* find(RowId row) const noexcept {
    return number_[row] == 0 ? nullptr : &rows_[number_[row] - std::size_t{1}];
  }

  [[nodiscard]] bool has(RowId row) const noexcept { return number_[row] != 0; }

  // ---- a queue of them ----
  // A row that is not in it is not asked.
  void ask(RowId row) noexcept;
  // The next; null: none.
  [[nodiscard]] Row* next() noexcept;

  [[nodiscard]] std::size_t memory_bytes() const {
    return rows_.resident_bytes() + aims_.resident_bytes() + number_.resident_bytes() +
           ring_.resident_bytes();
  }

 private:
  [[nodiscard]] std::size_t index(const Row& row) const noexcept { return number_[row.row] - std::size_t{1}; }

  LazyArray<Row> rows_;
  LazyArray<RowVector> aims_;        // [as rows_]
  LazyArray<std::uint32_t> number_;  // [row] 1 + index into rows_; 0: it is not in there
  LazyArray<std::uint32_t> ring_;
  std::size_t count_ = 0, head_ = 0, tail_ = 0;
};

}  // namespace voxel
