// SPDX-License-Identifier: GPL-3.0-or-later
// Finds the dependents of given voxels through links at their limits, and sums their loads and the stiffness
// of their springs.
//
// The search handles a row of 32 voxels at a time, as bits, because a tool that has pushed a chain to its
// limits has some ten thousand dependents.
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
  // Largest number of rows that are searched. Voxels in further rows count as independent.
  static constexpr std::size_t kMostRows = 4096;

  // Allocates; throws std::bad_alloc.
  explicit LimitReactions(const Lattice& lattice);

  // ---- none of these allocates or throws ----
  // Finds, on one axis, all dependents of `sources` (sorted by id, none anchored): voxels that depend on a
  // source, or on another dependent. A voxel depends on a neighbour in two cases. Either their link is at a
  // limit and pushes the voxel against the load of its own springs, or the link lets the voxel move in
  // neither direction. Earlier results are dropped.
  void gather(LevelStiffness& couplings, Displacement& state, std::span<const VoxelId> sources,
              int axis) noexcept;
  // Finds, on one axis, all dependents of a rigid block. The load of a voxel in another block is the load of
  // that block.
  void gather_on_block(LevelStiffness& couplings, Displacement& state, const Multigrid& multigrid,
                       std::size_t block, int axis) noexcept;
  // Is the voxel a dependent, or a source that has dependents? For other sources the answer is undefined.
  [[nodiscard]] bool gathered(VoxelId v) const noexcept {
    return (gathered_in(v / kRow) >> v % kRow & 1U) != 0;
  }
  // True if a link from this source to a voxel that is not anchored is at a limit.
  [[nodiscard]] bool at_limit(VoxelId source) const noexcept;
  // Sum of the loads of all dependents (N), without those of the sources. Sum of the stiffness of all links
  // between a dependent and a voxel that is neither dependent nor source (N/m).
  struct Dependents {
    double force_N = 0.0, stiffness_N_per_m = 0.0;
  };
  [[nodiscard]] Dependents dependents(const LevelStiffness& couplings) const noexcept;

  [[nodiscard]] std::size_t memory_bytes() const {
    return entry_.resident_bytes() + resident_bytes(rows_) + resident_bytes(queue_);
  }

 private:
  struct Gathering;
  // A row that was searched. The bits of a mask are lanes.
  struct Row {
    RowId row;
    LinksAtLimits links;
    std::uint32_t sources = 0, gathered = 0;
    std::uint32_t fresh = 0;  // gathered voxels whose neighbours are still to be visited
    bool queued = false;
  };
  enum class End : std::uint8_t { upper, lower };  // end of a link

  [[nodiscard]] const Row* find(RowId row) const noexcept {
    return entry_[row] == 0 ? nullptr : &rows_[entry_[row] - 1U];
  }
  void begin(Gathering& gathering, Displacement& state, int axis) noexcept;
  void find_all() noexcept;  // starts at the rows with sources
  Row* look_at(RowId row) noexcept;
  [[nodiscard]] static std::uint32_t pushed(const Row& row, std::uint32_t at_low, std::uint32_t at_high,
                                            End end) noexcept;
  void add(Row& row, std::uint32_t bits) noexcept;
  void ask(RowId row, std::uint32_t at_low, std::uint32_t at_high, End end) noexcept;
  [[nodiscard]] std::uint32_t gathered_in(RowId row) const noexcept {
    const Row* r = find(row);
    return r == nullptr ? 0U : r->gathered;
  }

  const Lattice& lattice_;
  Gathering* gathering_ = nullptr;  // set during gather()
  Displacement* state_ = nullptr;   // set during gather(); only read
  int axis_ = 0;
  LazyArray<std::uint16_t> entry_;  // [row] 1 + index into rows_; 0: not looked at
  LazyVector<Row> rows_;
  std::vector<std::uint32_t> queue_;  // ring of indices into rows_
  std::size_t head_ = 0, waiting_ = 0;
};

}  // namespace voxel
