// SPDX-License-Identifier: GPL-3.0-or-later
// Springs of one level of the multigrid hierarchy, row by row, in the layout of the inner loops.
//
// Level 0 is the lattice. A cell of level l stands for 2×2×2 cells of the next finer level. A coarse link
// combines the four finer links that cross the face between its two cells. These act in parallel, but a
// coarse link is twice as long. So its stiffness is half of their sum. Rows inside a region of one label
// share one set of constants. Any other row is written out when it is first prepared, so untouched tissue
// costs almost no memory: only the links of levels from kKept on are stored from the start.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "voxel/lattice/lattice.h"
#include "voxel/lattice/lazy_array.h"
#include "voxel/lattice/row_grid.h"

namespace voxel {

// Springs of one row on one axis: up[d][i] is the link of voxel i to its upper neighbour in d (N/m), 0 if
// there is none.
struct RowSprings {
  std::array<const float*, 3> up{}, down{};
  const float* inverse = nullptr;  // 1 / (sum over the six links); 0 for immovable voxels
};

// Springs of one row on all axes: [d][lane], along the link in d and across it. Down-links are the up-links
// of the row below and are read from there.
struct RowStiffness {  // uninitialised for speed: all() writes every member
  const float *up_along, *up_across;
  std::array<const float*, 3> down_along, down_across;  // [d], each of [lane]
  const float* inverse;                                 // [axis][lane]
  // [lane] bit `axis`: inverse is 0. One byte to read instead of three floats.
  const std::uint8_t* stands;
  bool uniform;  // the same in every lane
};

using LaneBits = std::array<std::uint8_t, kRow>;

using Lanes = std::array<float, kRow>;

// Limits on one axis for links with common limits: low[d] <= u(up) − u(v) <= high[d].
struct AxisLimits {
  std::array<float, 3> low{}, high{};

  AxisLimits() = default;
  AxisLimits(const std::array<LinkLimit, 3>& links, int axis) {
    for (std::size_t d = 0; d < 3; ++d) {
      const bool along = axis == static_cast<int>(d);
      low[d] = along ? links[d].along_low : -links[d].across;
      high[d] = along ? links[d].along_high : links[d].across;
    }
  }
};

// Limits of the links of one row: common to all lanes, or lane by lane, [d]. A missing link has limits of
// ± the largest float.
struct RowLimits {
  struct Written {
    std::array<Lanes, 3> up_low, up_high, up_across, down_low, down_high, down_across;
    std::array<AxisLimits, 3> tightest;  // [axis] no link is tighter
  };
  const std::array<AxisLimits, 3>* of = nullptr;  // [axis] no link is tighter
  const Written* lanes = nullptr;                 // null: all links have exactly the limits `of`
};

class LevelStiffness {
 public:
  // First level whose links and contents are stored for all cells. On finer levels they are found from the
  // next finer level on demand. Recursion over more levels would take too long in a tick where tissues mix.
  static constexpr int kKept = 3;

  // `finer`: the next finer level, owned by the caller; null for level 0.
  LevelStiffness(const Lattice& lattice, const LevelStiffness* finer);

  [[nodiscard]] const Grid& grid() const { return grid_; }
  [[nodiscard]] int level() const { return level_; }

  // Does the row contain a cell? The first call for a row classifies it and writes out springs that are not
  // uniform. Call it before the functions below that read a row. It never allocates address space, but the
  // first call may touch new pages.
  bool prepare(RowId row) noexcept {
    if ((kind_[row] & ready) == 0) make_ready(row);
    return kind(row) != empty;
  }
  // Rows with any cell, and the six rows beside each, whose values are read together with it.
  [[nodiscard]] std::vector<bool> rows_in_use();
  [[nodiscard]] bool uniform(RowId row) const { return kind(row) == one_label; }
  [[nodiscard]] RowSprings springs(RowId row, int axis) const noexcept;
  // Springs of a prepared row. Fills `out` by reference and member by member, for speed: a result by value
  // would be stored and at once reloaded in pieces of different sizes.
  void all(RowId row, RowStiffness& out) const noexcept {
    const Kind what = kind(row);
    if (what == one_label) {
      const Constant& c = *constant_[label_[row]];
      out.up_along = c.along[0].data();
      out.up_across = c.across[0].data();
      for (std::size_t d = 0; d < 3; ++d) {
        out.down_along[d] = c.along[d].data();
        out.down_across[d] = c.across[d].data();
      }
      out.inverse = c.inverse[0].data();
      out.stands = movable_.data();
      out.uniform = true;
      return;
    }
    out.uniform = false;
    if (what == mixed) {
      const Written& w = written_[written_at_[row]];
      out.up_along = w.up_along(0);
      out.up_across = w.up_across(0);
      out.down_along[0] = w.up_along(0) - 1;
      out.down_across[0] = w.up_across(0) - 1;
      for (std::size_t d = 1; d < 3; ++d) find_up(below(row, d), d, out.down_along[d], out.down_across[d]);
      out.inverse = w.inverse[0].data();
      out.stands = written_stands_[written_at_[row]].data();
      return;
    }
    out.up_along = out.up_across = out.inverse = zeros_[0].data();
    out.down_along.fill(zeros_[0].data());
    out.down_across.fill(zeros_[0].data());
    out.stands = immovable_.data();
  }
  // Prefetches the data of a prepared row that a correction reads.
  void fetch_ahead(RowId row) const noexcept {
    if (kind(row) != mixed) return;
    const std::uint32_t at = written_at_[row];
    __builtin_prefetch(&written_stands_[at]);
    if (written_limits_.size() == 0) return;
    const auto* tightest = reinterpret_cast<const char*>(&written_limits_[at].tightest);
    __builtin_prefetch(tightest);
    __builtin_prefetch(tightest + sizeof(RowLimits::Written::tightest) - 1);
  }
  // [lane] 1 / (number of finer cells in the cell); 0 if there is none. For prepared rows of coarse levels.
  [[nodiscard]] const float* share(RowId row) const noexcept {
    if (kind(row) == one_label) return eighths_.data();
    return kind(row) == mixed ? written_cells_[written_at_[row]].share.data() : zeros_[0].data();
  }
  // [lane] 1 for a cell, 0 otherwise. For prepared rows of coarse levels.
  [[nodiscard]] const float* filled(RowId row) const noexcept {
    if (kind(row) == one_label) return ones_.data();
    return kind(row) == mixed ? written_cells_[written_at_[row]].filled.data() : zeros_[0].data();
  }
  // Limits of a prepared row of level 0.
  [[nodiscard]] RowLimits limits(RowId row) const noexcept;
  // Springs of one voxel or cell on all axes. Prepares its row; for a prepared row it takes a few loads only.
  [[nodiscard]] VoxelSprings springs_of(VoxelId cell) noexcept;
  // Returns the springs of springs_of(), to the last bit, but does not prepare the row. Slower if the row is
  // not prepared.
  [[nodiscard]] VoxelSprings find_springs(VoxelId cell) const noexcept;
  // Does this cell of the grid contain a voxel?
  [[nodiscard]] bool has_voxel(const std::array<int, 3>& cell) const noexcept {
    return content(cell) != nothing;
  }
  [[nodiscard]] const Lattice& lattice() const { return lattice_; }

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  // `ready`: the row is classified. For a mixed row, so are the rows below it, whose up-links are its
  // down-links.
  enum Kind : std::uint8_t { unknown = 0, empty, one_label, mixed, ready };
  enum Content : std::uint8_t { nothing = 0, some = 1, held = 2 };
  static Content together(Content a, Content b) { return a == nothing || (a == held && b == some) ? b : a; }
  // Springs of the up-links of a mixed row, [d][lane]. The entry before lane 0 in x is the down-link of lane
  // 0. The other down-links are stored with their own rows, and Cells in an array of their own, so that a
  // cycle reads less memory.
  struct alignas(64) Written {
    // floats before the first value; the last of them is the link down along x
    static constexpr std::size_t kBefore = 8;
    std::array<float, kBefore + std::size_t{3} * kRow> along, across;
    std::array<Lanes, 3> inverse;

    [[nodiscard]] const float* up_along(std::size_t d) const { return along.data() + kBefore + d * kRow; }
    [[nodiscard]] const float* up_across(std::size_t d) const { return across.data() + kBefore + d * kRow; }
  };
  struct Cells {  // mixed row of a coarse level
    Lanes filled, share;
  };
  struct Constant {  // common springs of the rows of one label
    std::array<Lanes, 3> along, across, inverse;
  };

  [[nodiscard]] Kind kind(RowId row) const noexcept { return static_cast<Kind>(kind_[row] & mixed); }
  // The row whose up-links in d (1 or 2) lead to this row.
  [[nodiscard]] RowId below(RowId row, std::size_t d) const noexcept {
    return d == 1 ? row - 1 : row - grid_.row_z;
  }
  // Up-links in d of any classified row.
  void find_up(RowId row, std::size_t d, const float*& along, const float*& across) const noexcept {
    along = across = zeros_[0].data();
    if (kind(row) == one_label) {
      const Constant& c = *constant_[label_[row]];
      along = c.along[d].data();
      across = c.across[d].data();
    } else if (kind(row) == mixed) {
      const Written& w = written_[written_at_[row]];
      along = w.up_along(d);
      across = w.up_across(d);
    }
  }
  void make_ready(RowId row) noexcept;
  void find(RowId row) noexcept;
  [[nodiscard]] bool is_one_label(RowId row, std::uint8_t& label) const noexcept;
  bool write_out(RowId row) noexcept;
  [[nodiscard]] std::uint32_t find_written() noexcept;
  static void write_lane(std::size_t lane, const VoxelSprings& springs, Written& out,
                         LaneBits& stands) noexcept;
  bool write_voxels(RowId row, Written& out, LaneBits& stands) const noexcept;
  void write_limits(RowId row, RowLimits::Written& out) const noexcept;
  bool write_cells(RowId row, Written& out, LaneBits& stands, Cells& cells) const noexcept;
  void keep_cells();
  [[nodiscard]] Spring link(const std::array<int, 3>& cell, int d) const noexcept;
  [[nodiscard]] Spring link_from_finer(const std::array<int, 3>& cell, int d) const noexcept;
  [[nodiscard]] Content content(const std::array<int, 3>& cell) const noexcept;
  [[nodiscard]] Content content_from_finer(const std::array<int, 3>& cell) const noexcept;
  [[nodiscard]] VoxelSprings springs_by_links(const std::array<int, 3>& cell, Content inside) const noexcept;
  [[nodiscard]] VoxelSprings known_springs(VoxelId cell) const noexcept;

  const Lattice& lattice_;
  const LevelStiffness* finer_;
  int level_;
  Grid grid_;
  LazyArray<std::uint8_t> kind_, label_;   // [row]
  LazyArray<std::uint8_t> content_;        // [cell], on levels from kKept on; empty on finer ones
  std::array<LazyArray<Spring>, 3> link_;  // [d][cell], on levels from kKept on: link to the upper neighbour
  LazyArray<std::uint32_t> written_at_;    // [row] into written_
  LazyArray<Written> written_;
  LazyArray<Cells> written_cells_;  // indexed as written_; empty on level 0
  // Indexed as written_. A separate array, because corrections read only this part, and so their reads stay
  // together.
  LazyArray<LaneBits> written_stands_;
  LazyArray<RowLimits::Written> written_limits_;  // indexed as written_; empty if all limits are alike
  std::array<std::array<AxisLimits, 3>, 256> label_limits_;  // [label][axis]
  std::uint32_t written_count_ = 0;
  // Rows with equal springs share one copy, found by a hash. Along a face or between layers thousands of rows
  // are alike, and shared copies mean less memory to read.
  LazyArray<std::uint32_t> written_by_hash_;             // 1 + index into written_; 0: none
  std::array<std::unique_ptr<Constant>, 256> constant_;  // [label]
  Lanes ones_, eighths_;
  std::array<Lanes, 3> zeros_;  // [d or axis]
  LaneBits movable_, immovable_;
};

}  // namespace voxel
