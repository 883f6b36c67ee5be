// SPDX-License-Identifier: GPL-3.0-or-later
// Prolongation buffer: two planes of coarse corrections, already interpolated along x.
//
// Corrections are prolonged trilinearly. Each row of cells contributes to sixteen finer rows. So it is read
// and interpolated along x only once.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "voxel/lattice/lazy_array.h"
#include "voxel/lattice/row_grid.h"
#include "voxel/lattice/simd8.h"
#include "voxel/multigrid/row_smoother.h"

namespace voxel {

class Prolongation {
 public:
  Prolongation() = default;
  // Serves any box of `fine`, the grid of the finer of two levels. Allocates.
  explicit Prolongation(const Grid& fine);

  [[nodiscard]] std::size_t memory_bytes() const {
    return cells_.resident_bytes() + lanes_of_.resident_bytes() + resident_bytes(spread_);
  }

  // Starts a box: coarse Float8 first … last along x, coarse rows j0 … j1 of every plane.
  void begin(int first, int last, int j0, int j1) noexcept;
  [[nodiscard]] int first() const { return first_; }
  [[nodiscard]] int groups() const { return groups_; }

  // The cells of a row before interpolation, from coarse Float8 first() on. `which` 0 to 2 is the axis.
  // `which` 3 holds 1 for each cell that exists, else 0. The Float8 before and after are writable, too.
  [[nodiscard]] float* cells(std::size_t which) noexcept {
    return cells_.data() + which * cell_lanes_ + kLanes;
  }
  // Interpolates cells() along x. `whole`: every cell exists.
  void spread(int j, int k, bool is_source, bool whole) noexcept;
  // A row of lanes of the finer level, from its Float8 number `group` along x on.
  [[nodiscard]] ProlongedRow row(int j, int k, int group) const noexcept {
    const std::size_t at = slot(j, k);
    const float* lanes =
        lanes_of_.data() + at * 4 * lanes_ + static_cast<std::size_t>(group - 2 * first_) * kLanes;
    ProlongedRow out;
    out.is_source = spread_[at].is_source;
    if (!spread_[at].whole) out.weight = lanes + 3 * lanes_;
    for (std::size_t axis = 0; axis < 3; ++axis) out.sum[axis] = lanes + axis * lanes_;
    return out;
  }

 private:
  struct Spread {
    bool is_source = false, whole = true;
  };
  [[nodiscard]] std::size_t slot(int j, int k) const {
    return static_cast<std::size_t>(k & 1) * rows_ + static_cast<std::size_t>(j - j0_);
  }

  std::size_t rows_ = 0, lanes_ = 0, cell_lanes_ = 0;  // capacities
  int first_ = 0, groups_ = 0, j0_ = 0;
  LazyArray<float> cells_, lanes_of_;  // [axis, or 3][lane]; [slot][axis, or 3][lane]
  std::vector<Spread> spread_;         // [slot]
};

}  // namespace voxel
