// SPDX-License-Identifier: GPL-3.0-or-later
// What hangs on some voxels by links at their limits, found a row of 32 voxels at a time.
//
// A tool that pushed a chain tight has some ten thousand voxels hanging on those it presses. Looked for voxel
// by voxel, 30 ns each, they took more than all else in a tick; as bits of rows they take 0.4 of that.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "voxel/lattice/displacement.h"
#include "voxel/lattice/lattice.h"
#include "voxel/lattice/lazy_array.h"
#include "voxel/lattice/level_stiffness.h"
#include "voxel/multigrid/row_smoother.h"

namespace voxel {

class Multigrid;

class LimitReactions {
 public:
  static constexpr std::size_t kMostRows = 4096;  // that are looked at; what is further away hangs on nothing

  // Allocates; throws std::bad_alloc.
  explicit LimitReactions(const Lattice& lattice);

  // ---- none of these allocates or throws ----
  // On one axis, all that hangs on `roots` (in the order of their ids, none anchored), one by another: a
  // voxel does where a link to one of these is at a limit and pushes it the way its own links, and what else
  // pulls it, do not. One that its link lets go neither way hangs on it in any case. What was found before is
  // forgotten.
  void gather(LevelStiffness& couplings, Displacement& state, std::span<const VoxelId> roots,
              int axis) noexcept;
  // The same of what hangs on a part without slack. A voxel of another one is pulled as the whole of that is.
  void gather_on_block(LevelStiffness& couplings, Displacement& state, const Multigrid& multigrid,
                       std::size_t part, int axis) noexcept;
  // Is it one of them, or a root that they hang on? Of other roots it may say either.
  [[nodiscard]] bool carried(VoxelId v) const noexcept {
    return (carried_in(v / kRow) >> v % kRow & 1U) != 0;
  }
  // Of a root: is any link of it to what may move at a limit?
  [[nodiscard]] bool tight(VoxelId root) const noexcept;
  // What pulls all that hangs on the roots, without these (N), and the springs of their links to what does
  // not hang on them (N/m).
  struct Hanging {
    double force_N = 0.0, stiffness_N_per_m = 0.0;
  };
  [[nodiscard]] Hanging hanging(const LevelStiffness& couplings) const noexcept;

  [[nodiscard]] std::size_t memory_bytes() const {
    return entry_.resident_bytes() + resident_bytes(rows_) + resident_bytes(queue_);
  }

 private:
  struct Gathering;
  // Bits are lanes.
  struct Row {
    RowId row;
    LinksAtLimits links;
    std::uint32_t roots = 0, carried = 0;
    std::uint32_t fresh = 0;  // of these, whose neighbours were not looked at yet
    bool queued = false;
  };
  enum class End : std::uint8_t { upper, lower };  // of a link

  [[nodiscard]] const Row* find(RowId row) const noexcept {
    return entry_[row] == 0 ? nullptr : &rows_[entry_[row] - 1U];
  }
  void begin(Gathering& gathering, Displacement& state, int axis) noexcept;
  void find_all() noexcept;  // from the roots on, by which rows were looked at
  Row* look_at(RowId row) noexcept;
  [[nodiscard]] static std::uint32_t pushed(const Row& row, std::uint32_t at_low, std::uint32_t at_high,
                                            End end) noexcept;
  void add(Row& row, std::uint32_t bits) noexcept;
  void ask(RowId row, std::uint32_t at_low, std::uint32_t at_high, End end) noexcept;
  [[nodiscard]] std::uint32_t carried_in(RowId row) const noexcept {
    const Row* r = find(row);
    return r == nullptr ? 0U : r->carried;
  }

  const Lattice& lattice_;
  Gathering* gathering_ = nullptr;  // while it gathers
  Displacement* state_ = nullptr;   // …, only read
  int axis_ = 0;
  LazyArray<std::uint16_t> entry_;  // [row] 1 + index into rows_; 0: not looked at
  LazyVector<Row> rows_;
  std::vector<std::uint32_t> queue_;  // into rows_, a ring
  std::size_t head_ = 0, waiting_ = 0;
};

}  // namespace voxel
