// SPDX-License-Identifier: GPL-3.0-or-later
// The innermost loops of relaxation: one axis of one row at a time, in vectors.
#pragma once

#include <array>

#include "voxel/sparse/couplings.h"
#include "voxel/sparse/grid.h"
#include "voxel/sparse/lattice.h"

namespace voxel::sparse {

using Row = std::array<float, kRow>;

// A row of some field on a grid, and the rows around it.
struct RowView {
  const float *own, *y_down, *y_up, *z_down, *z_up;
  float left, right;  // the values beyond both ends

  RowView(const Grid& grid, const float* field, RowId row)
      : own(field + static_cast<std::size_t>(row) * kRow),
        y_down(own - kRow),
        y_up(own + kRow),
        z_down(own - static_cast<std::size_t>(grid.row_z) * kRow),
        z_up(own + static_cast<std::size_t>(grid.row_z) * kRow),
        left(*(own - static_cast<std::size_t>(grid.row_x) * kRow + kRow - 1)),
        right(*(own + static_cast<std::size_t>(grid.row_x) * kRow)) {}
};

// Limits of all links of a lattice on one axis: low[d] <= u(up) − u(v) <= high[d].
struct AxisLimits {
  std::array<float, 3> low{}, high{};

  AxisLimits(const Lattice& lattice, int axis) {
    for (int d = 0; d < 3; ++d) {
      const LinkLimit& l = lattice.tightest(d);
      low[static_cast<std::size_t>(d)] = axis == d ? l.along_low : -l.across;
      high[static_cast<std::size_t>(d)] = axis == d ? l.along_high : l.across;
    }
  }
};

// The part of Σ k·u(neighbour) that the rows beside this one in y and z make up, and `load` (N; may be null).
void row_beside(const RowSprings& springs, const RowView& u, const float* load, float* out) noexcept;
// Where each voxel would go if its links, and `load`, pulled alone, given row_beside() and the row itself as
// it is now (`x`: kRow values; left and right beyond its ends).
void row_minimum(const RowSprings& springs, const float* beside, const float* x, float left, float right,
                 float* out) noexcept;
// What its links, and `load`, pull each voxel with that may move (N); 0 for others.
void row_residual(const RowSprings& springs, const RowView& u, const float* load, float* out) noexcept;
// Σ k (u(neighbour) − u) for every voxel, anchored ones too (N).
void row_pull(const RowSprings& springs, const RowView& u, float* out) noexcept;
// Brings `wanted` into what the links of each voxel allow it beside its neighbours as they are.
void clamp_row(const RowSprings& springs, const RowView& u, const AxisLimits& limits, float* wanted) noexcept;
// The largest |a[i] − b[i]|, and the largest |a[i]|·weight[i].
float row_difference(const float* a, const float* b) noexcept;
float row_weighted(const float* a, const float* weight) noexcept;
// Would any link of the row reach `share` of the limits if all its voxels were where they want to be?
bool row_near_limits(const RowSprings& springs, const RowView& u, const AxisLimits& limits, float share,
                     const float* wanted) noexcept;
// Takes every second value of `wanted` over into the row, beginning with `first` (0 or 1).
void take_row(float* own, const float* wanted, int first) noexcept;

}  // namespace voxel::sparse
