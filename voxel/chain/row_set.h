// SPDX-License-Identifier: GPL-3.0-or-later
// The set of rows that a wave moved.
#pragma once

#include <cstddef>
#include <cstdint>
#include <iterator>

#include "voxel/lattice/lazy_array.h"
#include "voxel/lattice/row_grid.h"

namespace voxel {

// A set of rows, iterated in the order of insertion. It is stored as runs of rows that are consecutive in y,
// and one bit per row, because a large wave moves whole columns of rows at a time.
class RowSet {
 public:
  RowSet() = default;
  explicit RowSet(std::size_t rows) : bits_((rows + kBits - 1) / kBits), runs_(rows + 1) {}

  void clear() noexcept {
    for (std::size_t n = 0; n < count_; ++n) {
      const std::size_t last = (std::size_t{runs_[n].from} + runs_[n].rows - 1) / kBits;
      for (std::size_t word = runs_[n].from / kBits; word <= last; ++word) bits_[word] = 0;
    }
    count_ = 0;
  }
  [[nodiscard]] bool has(RowId row) const noexcept { return (bits_[row / kBits] >> (row % kBits) & 1U) != 0; }
  void add(RowId row) noexcept {
    std::uint64_t& word = bits_[row / kBits];
    const std::uint64_t bit = std::uint64_t{1} << (row % kBits);
    if ((word & bit) != 0) return;
    word |= bit;
    append(row, 1);
  }
  // Adds `rows` >= 1 consecutive rows. The first of them is `from`.
  void add(RowId from, RowId rows) noexcept {
    const RowId last = from + rows - 1;
    const auto bits_of = [&](RowId word) {
      const std::uint64_t below = word == last / kBits ? kAllBits >> (kBits - 1 - last % kBits) : kAllBits;
      return word == from / kBits ? below & kAllBits << (from % kBits) : below;
    };
    for (RowId word = from / kBits; word <= last / kBits; ++word) {
      std::uint64_t added = bits_of(word) & ~bits_[word];
      bits_[word] |= added;
      while (added != 0) {  // one run of set bits after another
        const auto first = static_cast<RowId>(__builtin_ctzll(added));
        const std::uint64_t beyond = ~(added >> first);
        const RowId length = beyond == 0 ? kBits : static_cast<RowId>(__builtin_ctzll(beyond));
        append(word * kBits + first, length);
        added &= first + length == kBits ? 0 : kAllBits << (first + length);
      }
    }
  }

  [[nodiscard]] bool empty() const noexcept { return count_ == 0; }
  [[nodiscard]] std::size_t size() const noexcept {
    std::size_t rows = 0;
    for (std::size_t n = 0; n < count_; ++n) rows += runs_[n].rows;
    return rows;
  }
  [[nodiscard]] std::size_t resident_bytes() const { return bits_.resident_bytes() + runs_.resident_bytes(); }

 private:
  struct Run {
    RowId from, rows;
  };

 public:
  class Iterator {
   public:
    using iterator_category = std::input_iterator_tag;
    using value_type = RowId;
    using difference_type = std::ptrdiff_t;
    using pointer = const RowId*;
    using reference = RowId;

    explicit Iterator(const Run* run) noexcept : run_(run) {}
    RowId operator*() const noexcept { return run_->from + at_; }
    Iterator& operator++() noexcept {
      if (++at_ == run_->rows) {
        ++run_;
        at_ = 0;
      }
      return *this;
    }
    friend bool operator==(const Iterator& a, const Iterator& b) noexcept {
      return a.run_ == b.run_ && a.at_ == b.at_;
    }

   private:
    const Run* run_;
    RowId at_ = 0;
  };
  [[nodiscard]] Iterator begin() const noexcept { return Iterator(runs_.data()); }
  [[nodiscard]] Iterator end() const noexcept { return Iterator(runs_.data() + count_); }

 private:
  static constexpr RowId kBits = 64;
  static constexpr std::uint64_t kAllBits = ~std::uint64_t{0};

  void append(RowId from, RowId rows) noexcept {
    if (count_ > 0 && runs_[count_ - 1].from + runs_[count_ - 1].rows == from)
      runs_[count_ - 1].rows += rows;
    else
      runs_[count_++] = {from, rows};
  }

  LazyArray<std::uint64_t> bits_;  // bit of each row
  LazyArray<Run> runs_;
  std::size_t count_ = 0;
};

}  // namespace voxel
