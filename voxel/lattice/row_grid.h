// SPDX-License-Identifier: GPL-3.0-or-later
// Memory layout of a lattice: the index of voxel (i, j, k).
//
// Voxels are stored in rows of kRow along x. A row's neighbours in y and z lie a constant number of rows
// away, so inner loops are plain strides. The next row along x lies in another column. A page of memory
// contains rows that are near one another in y, so a small contact touches few pages. An empty row borders
// every side: every voxel has six neighbours, and no bound is checked.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace voxel {

using VoxelId = std::uint32_t;  // index into a grid
using RowId = std::uint32_t;    // VoxelId / kRow

inline constexpr int kRow = 32;  // voxels in a row; a power of two

struct Grid {
  Grid() = default;
  explicit Grid(const std::array<int, 3>& voxels)
      : dims(voxels),
        columns((voxels[0] + kRow - 1) / kRow + 2),
        row_z(static_cast<RowId>(voxels[1]) + 2),
        row_x(row_z * (static_cast<RowId>(voxels[2]) + 2)) {}

  std::array<int, 3> dims{0, 0, 0};  // voxels, without the border
  int columns = 0;                   // rows along x, including the empty ones at both ends
  RowId row_z = 1, row_x = 1;        // rows between neighbours in z, in x; 1 in y

  [[nodiscard]] std::size_t rows() const {
    return static_cast<std::size_t>(columns) * static_cast<std::size_t>(row_x);
  }
  [[nodiscard]] std::size_t size() const { return rows() * kRow; }

  // Voxel (i, j, k); each from -1 to dims, inclusive.
  [[nodiscard]] VoxelId at(int i, int j, int k) const {
    return row(((i + kRow) / kRow), j, k) * kRow + static_cast<VoxelId>((i + kRow) % kRow);
  }
  // Row in column c (column 1 starts at i = 0), y = j, z = k.
  [[nodiscard]] RowId row(int c, int j, int k) const {
    return static_cast<RowId>(c) * row_x + static_cast<RowId>(k + 1) * row_z + static_cast<RowId>(j + 1);
  }
  [[nodiscard]] std::array<int, 3> coordinates(VoxelId v) const {
    const std::array<int, 3> c = row_coordinates(v / kRow);
    return {(c[0] - 1) * kRow + static_cast<int>(v % kRow), c[1], c[2]};
  }
  // Column, y and z of a row.
  [[nodiscard]] std::array<int, 3> row_coordinates(RowId r) const {
    const RowId in_column = r % row_x;
    return {static_cast<int>(r / row_x), static_cast<int>(in_column % row_z) - 1,
            static_cast<int>(in_column / row_z) - 1};
  }

  // Next and previous neighbour on axis d.
  [[nodiscard]] VoxelId up(VoxelId v, int d) const {
    if (d == 0) return v % kRow == kRow - 1 ? v + (row_x - 1) * kRow + 1 : v + 1;
    return v + (d == 1 ? 1U : row_z) * kRow;
  }
  [[nodiscard]] VoxelId down(VoxelId v, int d) const {
    if (d == 0) return v % kRow == 0 ? v - (row_x - 1) * kRow - 1 : v - 1;
    return v - (d == 1 ? 1U : row_z) * kRow;
  }
};

// The grid of half the resolution: cell c holds the voxels 2c and 2c + 1 of each axis.
inline Grid coarsened(const Grid& fine) {
  return Grid({(fine.dims[0] + 1) / 2, (fine.dims[1] + 1) / 2, (fine.dims[2] + 1) / 2});
}

}  // namespace voxel
