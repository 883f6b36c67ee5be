// SPDX-License-Identifier: GPL-3.0-or-later
// The springs of one level of the multigrid hierarchy, row by row, as inner loops want them.
//
// Level 0 is the lattice; a cell of level l stands for 2×2×2 cells of the level below it. A coarse link is as
// many fine links side by side as cross the face between its two cells, each 2^l times as long: half the sum
// of the four of the level below. Rows inside a region of one label share one set of constants; any other row
// has its springs written out when it is first asked for. So untouched tissue costs nothing: what is kept of
// it from the start is the links of coarse levels alone, a few hundredths of a byte a voxel.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "voxel/lattice/lattice.h"
#include "voxel/lattice/lazy_array.h"
#include "voxel/lattice/row_grid.h"

namespace voxel {

// Springs of one row on one axis: up[d][i] is the link of voxel i to its upper neighbour in d (N/m), 0 where
// there is none.
struct RowSprings {
  std::array<const float*, 3> up{}, down{};
  const float* inverse = nullptr;  // 1 / Σ; 0 where nothing may move
};

// Those of all axes: [d][lane], what the link in d weighs on its own axis and on the two others. Links down
// are those up of the row below, and read from there.
struct RowStiffness {  // all is written by who finds them: with zeros before that, a row took a tenth longer
  const float *up_along, *up_across;
  std::array<const float*, 3> down_along, down_across;  // [d], each of [lane]
  const float* inverse;                                 // [axis][lane]
  // [lane] bit `axis`: inverse is 0. A twelfth of what there is to read of that.
  const std::uint8_t* stands;
  bool uniform;  // the same in every lane
};

using LaneBits = std::array<std::uint8_t, kRow>;

using Lanes = std::array<float, kRow>;

// Limits of all links of a lattice, or of a label, on one axis: low[d] <= u(up) − u(v) <= high[d].
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

// Limits of the links of one row of voxels: the same for all, or lane by lane, [d], without end where there
// is no link.
struct RowLimits {
  struct Written {
    std::array<Lanes, 3> up_low, up_high, up_across, down_low, down_high, down_across;
    std::array<AxisLimits, 3> tightest;  // [axis] no link is tighter
  };
  const std::array<AxisLimits, 3>* of = nullptr;  // [axis] no link is tighter
  const Written* lanes = nullptr;                 // null: all are as tight as that
};

class LevelStiffness {
 public:
  // The first level whose links and contents are kept for all cells. To find one of its rows from those below
  // took a millisecond where tissues mix; written out as inner loops want them (1.5 kB a row), they took
  // three times as much memory.
  static constexpr int kKept = 3;

  // `finer`: the level below, kept by the caller; none for level 0.
  LevelStiffness(const Lattice& lattice, const LevelStiffness* finer);

  [[nodiscard]] const Grid& grid() const { return grid_; }
  [[nodiscard]] int level() const { return level_; }

  // Is there any cell in this row? Finds out, and writes out the springs where they are not uniform: call it
  // before what follows. Allocates address space never, pages of memory the first time.
  bool prepare(RowId row) noexcept {
    if ((kind_[row] & ready) == 0) make_ready(row);
    return kind(row) != empty;
  }
  // Rows in which there is anything, and those beside them, whose values are read with theirs.
  [[nodiscard]] std::vector<bool> rows_in_use();
  [[nodiscard]] bool uniform(RowId row) const { return kind(row) == one_label; }
  [[nodiscard]] RowSprings springs(RowId row, int axis) const noexcept;
  // By reference, and member by member: returned by value it was written and read back at once in pieces of
  // different sizes, which took longer than to smooth an octet.
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
  // Has what a correction reads of a row fetched into the cache meanwhile; of one that was found.
  void fetch_ahead(RowId row) const noexcept {
    if (kind(row) != mixed) return;
    const std::uint32_t at = written_at_[row];
    __builtin_prefetch(&written_stands_[at]);
    if (written_limits_.size() == 0) return;
    const auto* tightest = reinterpret_cast<const char*>(&written_limits_[at].tightest);
    __builtin_prefetch(tightest);
    __builtin_prefetch(tightest + sizeof(RowLimits::Written::tightest) - 1);
  }
  // [lane] 1 / number of cells of the level below; 0 where there is none. Not of level 0, of a prepared row.
  [[nodiscard]] const float* share(RowId row) const noexcept {
    if (kind(row) == one_label) return eighths_.data();
    return kind(row) == mixed ? written_cells_[written_at_[row]].share.data() : zeros_[0].data();
  }
  // [lane] 1 where there is a cell, 0 elsewhere; the same.
  [[nodiscard]] const float* filled(RowId row) const noexcept {
    if (kind(row) == one_label) return ones_.data();
    return kind(row) == mixed ? written_cells_[written_at_[row]].filled.data() : zeros_[0].data();
  }
  // Of level 0.
  [[nodiscard]] RowLimits limits(RowId row) const noexcept;
  // Those of one voxel or cell, on all axes; a few loads once its row was prepared, which it sees to.
  [[nodiscard]] VoxelSprings springs_of(VoxelId cell) noexcept;
  // The same to the last bit, and nothing is written out for it: slower where nobody prepared its row.
  [[nodiscard]] VoxelSprings find_springs(VoxelId cell) const noexcept;
  // Is there a voxel in this cell of the grid?
  [[nodiscard]] bool holds_any(const std::array<int, 3>& cell) const noexcept {
    return content(cell) != nothing;
  }
  [[nodiscard]] const Lattice& lattice() const { return lattice_; }

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  // `ready`: so are the rows whose links up are those down of this one, unless they are the same anyway.
  enum Kind : std::uint8_t { unknown = 0, empty, one_label, mixed, ready };
  enum Content : std::uint8_t { nothing = 0, some = 1, held = 2 };
  static Content together(Content a, Content b) { return a == nothing || (a == held && b == some) ? b : a; }
  // Springs of a mixed row: of the links up, [d][lane]; before those in x, the link of the voxel before the
  // first. (With those down, which are their neighbours', and what is now Cells, a cycle round a contact
  // waited for 2.2 kB a row.)
  struct alignas(64) Written {
    static constexpr std::size_t kBefore = 8;
    std::array<float, kBefore + std::size_t{3} * kRow> along, across;
    std::array<Lanes, 3> inverse;

    [[nodiscard]] const float* up_along(std::size_t d) const { return along.data() + kBefore + d * kRow; }
    [[nodiscard]] const float* up_across(std::size_t d) const { return across.data() + kBefore + d * kRow; }
  };
  struct Cells {  // of a mixed row of a coarse level
    Lanes filled, share;
  };
  struct Constant {  // springs of all rows of one label
    std::array<Lanes, 3> along, across, inverse;
  };

  [[nodiscard]] Kind kind(RowId row) const noexcept { return static_cast<Kind>(kind_[row] & mixed); }
  // The row whose links up in d, 1 or 2, lead to this one.
  [[nodiscard]] RowId below(RowId row, std::size_t d) const noexcept {
    return d == 1 ? row - 1 : row - grid_.row_z;
  }
  // The links up in d of any row that was found.
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
  LazyArray<std::uint8_t> content_;        // [cell], from kKept on; found on the fly below
  std::array<LazyArray<Spring>, 3> link_;  // [d][cell], likewise: to its upper neighbour
  LazyArray<std::uint32_t> written_at_;    // [row] into written_
  LazyArray<Written> written_;
  LazyArray<Cells> written_cells_;  // as written_; none of level 0
  // As written_, and apart from it: corrections read no more than this, and what they read stands together.
  // (In there, to wait for it was a third of what it took to add a result.)
  LazyArray<LaneBits> written_stands_;
  LazyArray<RowLimits::Written> written_limits_;  // as written_; empty where all links have the same
  std::array<std::array<AxisLimits, 3>, 256> label_limits_;  // [label][axis]
  std::uint32_t written_count_ = 0;
  // Rows with the same springs share them: along a face or between layers there are thousands of each kind,
  // and to wait for 2 kB of its own a row was a third of what a whole cycle of 10^6 voxels took.
  LazyArray<std::uint32_t> written_by_hash_;             // 1 + index into written_; 0: none
  std::array<std::unique_ptr<Constant>, 256> constant_;  // [label]
  Lanes ones_, eighths_;
  std::array<Lanes, 3> zeros_;  // [d or axis]
  LaneBits movable_, immovable_;
};

}  // namespace voxel
