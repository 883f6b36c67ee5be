// SPDX-License-Identifier: GPL-3.0-or-later
// A first-in, first-out queue of tiles of voxels that are to be relaxed. It holds each tile at most once.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "voxel/lattice/lazy_array.h"
#include "voxel/lattice/row_grid.h"

namespace voxel {

class TileQueue {
 public:
  // Rows of a tile in y and in z; along x it is one row.
  static constexpr int kSide = 8;
  struct Tile {
    int column = 0, j = 0, k = 0;  // its first row is grid.row(column + 1, j · kSide, k · kSide)
  };

  explicit TileQueue(const Grid& grid)
      : columns_(grid.columns - 2),
        js_((grid.dims[1] + kSide - 1) / kSide),
        ks_((grid.dims[2] + kSide - 1) / kSide),
        waits_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(js_) *
               static_cast<std::size_t>(ks_)),
        order_(waits_.size()) {}

  [[nodiscard]] std::size_t tiles() const { return waits_.size(); }
  [[nodiscard]] std::size_t waiting() const { return waiting_; }
  // Call when something moved in this row (Grid::row_coordinates). Queues the row's tile and the tiles beside
  // it in x. If the row is at the tile's border in y or z, the tile beyond that border is queued, too.
  void mark_dirty(const std::array<int, 3>& row) noexcept {
    const int column = row[0] - 1, j = row[1], k = row[2];
    push(column, j, k);
    if (j % kSide == 0) push(column, j - 1, k);
    if (j % kSide == kSide - 1) push(column, j + 1, k);
    if (k % kSide == 0) push(column, j, k - 1);
    if (k % kSide == kSide - 1) push(column, j, k + 1);
    push(column - 1, j, k);
    push(column + 1, j, k);
  }
  void push(std::size_t number) noexcept {
    if (waits_[number] != 0) return;
    waits_[number] = 1;
    order_[(first_ + waiting_) % order_.size()] = static_cast<std::uint32_t>(number);
    ++waiting_;
  }
  // Call only if waiting() > 0.
  std::size_t pop() noexcept {
    const std::size_t number = order_[first_];
    first_ = (first_ + 1) % order_.size();
    --waiting_;
    waits_[number] = 0;
    return number;
  }
  void clear() noexcept {
    while (waiting_ > 0) pop();
  }
  [[nodiscard]] Tile tile(std::size_t number) const {
    const int n = static_cast<int>(number);
    return {n / (js_ * ks_), n % js_, n / js_ % ks_};
  }
  [[nodiscard]] std::size_t memory_bytes() const { return waits_.resident_bytes() + order_.resident_bytes(); }

 private:
  void push(int column, int j, int k) noexcept {
    if (column < 0 || column >= columns_ || j < 0 || k < 0 || j >= js_ * kSide || k >= ks_ * kSide) return;
    push((static_cast<std::size_t>(column) * static_cast<std::size_t>(ks_) +
          static_cast<std::size_t>(k / kSide)) *
             static_cast<std::size_t>(js_) +
         static_cast<std::size_t>(j / kSide));
  }

  int columns_, js_, ks_;
  LazyArray<std::uint8_t> waits_;
  LazyArray<std::uint32_t> order_;  // ring buffer, from first_ on
  std::size_t first_ = 0, waiting_ = 0;
};

}  // namespace voxel
