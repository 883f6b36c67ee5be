// SPDX-License-Identifier: GPL-3.0-or-later
// The springs of one level of the multigrid hierarchy, row by row, as inner loops want them.
//
// Level 0 is the lattice; a cell of level l stands for 2×2×2 cells of the level below it. A coarse link is as
// many fine links side by side as cross the face between its two cells, each 2^l times as long: half the sum
// of the four of the level below. Rows inside a region of one label share one set of constants; any other row
// has its springs written out when it is first asked for. So untouched tissue costs nothing, on any level.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "voxel/sparse/grid.h"
#include "voxel/sparse/lattice.h"
#include "voxel/sparse/lazy_array.h"

namespace voxel::sparse {

// Springs of one row on one axis: up[d][i] is the link of voxel i to its upper neighbour in d (N/m), 0 where
// there is none.
struct RowSprings {
  std::array<const float*, 3> up{}, down{};
  const float* inverse = nullptr;  // 1 / Σ; 0 where nothing may move
};

class Couplings {
 public:
  // `finer`: the level below, kept by the caller; none for level 0.
  Couplings(const Lattice& lattice, const Couplings* finer);

  [[nodiscard]] const Grid& grid() const { return grid_; }
  [[nodiscard]] int level() const { return level_; }

  // Is there any cell in this row? Finds out, and writes out the springs where they are not uniform: call it
  // before what follows. Allocates address space never, pages of memory the first time.
  bool prepare(RowId row) noexcept {
    if (kind_[row] == unknown) find(row);
    return kind_[row] != empty;
  }
  [[nodiscard]] bool uniform(RowId row) const { return kind_[row] == one_label; }
  [[nodiscard]] RowSprings springs(RowId row, int axis) const noexcept;
  // Those of one voxel or cell, on all axes; a few loads once its row was prepared, which it sees to.
  [[nodiscard]] VoxelSprings springs_of(VoxelId cell) noexcept;
  [[nodiscard]] const Lattice& lattice() const { return lattice_; }
  // 1 where there is a cell, 0 elsewhere; of a prepared row.
  [[nodiscard]] const float* filled(RowId row) const noexcept;

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  enum Kind : std::uint8_t { unknown = 0, empty, one_label, mixed };
  enum Content : std::uint8_t { nothing = 0, some = 1, held = 2 };
  using Lanes = std::array<float, kRow>;
  struct Written {  // springs of a mixed row
    std::array<Lanes, 3> up_along, up_across, down_along, down_across, inverse;
    Lanes filled;
  };
  struct Constant {  // springs of all rows of one label
    std::array<Lanes, 3> along, across, inverse;
  };

  void find(RowId row) noexcept;
  [[nodiscard]] bool is_one_label(RowId row, std::uint8_t& label) const noexcept;
  void write_out(RowId row, Written& out) const noexcept;
  static void write_lane(std::size_t lane, const VoxelSprings& springs, Written& out) noexcept;
  void write_voxels(RowId row, Written& out) const noexcept;
  void write_cells(RowId row, Written& out) const noexcept;
  [[nodiscard]] Spring link(const std::array<int, 3>& cell, int d) const noexcept;
  [[nodiscard]] Content content(const std::array<int, 3>& cell) const noexcept;

  const Lattice& lattice_;
  const Couplings* finer_;
  int level_;
  Grid grid_;
  LazyArray<std::uint8_t> kind_, label_;  // [row]
  LazyArray<std::uint8_t> content_;       // [cell], from level 2 on; found on the fly below
  LazyArray<std::uint32_t> written_at_;   // [row] into written_
  LazyArray<Written> written_;
  std::uint32_t written_count_ = 0;
  std::array<std::unique_ptr<Constant>, 256> constant_;  // [label]
  Lanes ones_, zeros_;
};

}  // namespace voxel::sparse
