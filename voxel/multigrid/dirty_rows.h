// SPDX-License-Identifier: GPL-3.0-or-later
// A log of the rows written since clear(). It lists each row once, by level.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "voxel/lattice/lazy_array.h"
#include "voxel/lattice/row_grid.h"

namespace voxel {

class ChangeLog {
 public:
  // Starts the log. `rows`: number of rows on each level. Allocates. Before this call nothing is noted.
  void begin(std::span<const std::size_t> rows) {
    levels_.clear();
    for (const std::size_t n : rows) levels_.push_back({LazyArray<std::uint8_t>(n), LazyArray<RowId>(n), 0});
  }

  void note(int level, RowId row) noexcept {
    if (levels_.empty()) return;
    Level& l = levels_[static_cast<std::size_t>(level)];
    if (l.noted[row] != 0) return;
    l.noted[row] = 1;
    l.rows[l.count++] = row;
  }
  [[nodiscard]] bool has(int level, RowId row) const {
    return levels_[static_cast<std::size_t>(level)].noted[row] != 0;
  }
  // The rows, in the order in which they were first written.
  [[nodiscard]] std::span<const RowId> rows(int level) const {
    const Level& l = levels_[static_cast<std::size_t>(level)];
    return {l.rows.data(), l.count};
  }
  [[nodiscard]] std::size_t count() const {
    std::size_t sum = 0;
    for (const Level& l : levels_) sum += l.count;
    return sum;
  }
  void clear() noexcept {
    for (std::size_t level = 0; level < levels_.size(); ++level) clear(static_cast<int>(level));
  }
  void clear(int level) noexcept {
    Level& l = levels_[static_cast<std::size_t>(level)];
    for (std::size_t i = 0; i < l.count; ++i) l.noted[l.rows[i]] = 0;
    l.count = 0;
  }
  [[nodiscard]] std::size_t memory_bytes() const {
    std::size_t bytes = 0;
    for (const Level& l : levels_) bytes += l.noted.resident_bytes() + l.rows.resident_bytes();
    return bytes;
  }

 private:
  struct Level {
    LazyArray<std::uint8_t> noted;  // [row]
    LazyArray<RowId> rows;
    std::size_t count = 0;
  };
  std::vector<Level> levels_;
};

}  // namespace voxel
