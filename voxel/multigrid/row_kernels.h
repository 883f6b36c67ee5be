// SPDX-License-Identifier: GPL-3.0-or-later
// Inner loops of relaxation on one axis of one row, in vectors.
#pragma once

#include <array>

#include "voxel/lattice/lattice.h"
#include "voxel/lattice/level_stiffness.h"
#include "voxel/lattice/row_grid.h"

namespace voxel {

using Row = std::array<float, kRow>;

// A row of a field on a grid, and the rows around it.
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

// Would any link of the row reach `share` of its limits if the row's voxels stood at `wanted`?
bool row_near_limits(const RowSprings& springs, const RowView& u, const AxisLimits& limits, float share,
                     const float* wanted) noexcept;

}  // namespace voxel
