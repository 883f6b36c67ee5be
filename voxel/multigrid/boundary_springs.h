// SPDX-License-Identifier: GPL-3.0-or-later
// Boundary springs: the stiffness that fixed voxels (anchors, tool contacts, and obstacle contacts along
// their normal) add to each coarse cell.
//
// A link from a free voxel to a fixed one is a spring between the free voxel's cell and the fixed voxel. On
// the next coarser level this spring is in series with half a link of that level, because the middle of the
// coarser cell is that much further away. This has two consequences. A plane of fixed voxels is at the same
// place on every level. A single fixed voxel holds a large cell with about the stiffness of one voxel in an
// infinite lattice (3.96 times that of one of its links; Cserti, Am. J. Phys. 68, 2000). Each axis, and links
// in each direction, are treated independently.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "voxel/lattice/lattice.h"
#include "voxel/lattice/lazy_array.h"
#include "voxel/lattice/level_stiffness.h"

namespace voxel {

class BoundarySprings {
 public:
  // The way in which a voxel is fixed: not at all, on all axes, or along a normal while it slides on the tool
  // or on an obstacle.
  struct Support {
    enum class By : std::uint8_t { nothing, obstacle, tool, all } by = By::nothing;
    // Normal (unit: 1/kUnit). It is rounded, so that it does not change if the surface hardly turns.
    std::array<std::int8_t, 3> n{};
    bool operator==(const Support&) const = default;
    [[nodiscard]] bool slides() const { return by == By::obstacle || by == By::tool; }
  };
  static constexpr int kUnit = 127;  // length of Support::n
  [[nodiscard]] static Support along(const glm::vec3& normal, Support::By what) noexcept;
  static constexpr Support kAll{Support::By::all, {}};

  // `levels`: level 0 first; must outlive this. Allocates.
  BoundarySprings(const Lattice& lattice, const std::vector<LevelStiffness*>& levels);

  // Sets the voxels that the tool and other objects hold on all axes; at most as many as there are surface
  // voxels.
  void set_held(std::span<const VoxelId> held) noexcept;
  // Sets the support of voxel v by its obstacle, or by the tool that it slides on. Takes effect with renew().
  void support(VoxelId v, const Support& by) noexcept;
  [[nodiscard]] bool supports(RowId row) const { return row_supported_[row] != 0; }
  void renew() noexcept;

  // ---- of coarse rows ----
  // True if any cell of the row has a boundary spring. Call it before the queries below, because it finds
  // springs of anchors on first use.
  [[nodiscard]] bool any(int level, RowId row) noexcept {
    if ((at(level).row_held[row] & kWaits) != 0) find_waiting(level, row);
    return at(level).row_held[row] != 0;
  }
  // [lane] Stiffness of the boundary spring divided by that of all links of the cell.
  [[nodiscard]] const float* hold(int level, RowId row, std::size_t axis) const {
    return at(level).hold[axis].data() + static_cast<std::size_t>(row) * kRow;
  }
  // [lane] A cell takes the share 1 / (1 + nearer) of a correction that is prolonged to it. The share is less
  // than 1, because the cell is nearer to the fixed voxel than the middle of the coarser cell is.
  [[nodiscard]] const float* nearer(int level, RowId row, std::size_t axis) const {
    return at(level).nearer[axis].data() + static_cast<std::size_t>(row) * kRow;
  }
  // Are the axes of any cell in the row coupled? A fixed voxel on an inclined surface couples the axes of
  // its cell.
  [[nodiscard]] bool tilted(int level, RowId row) const { return at(level).row_tilted[row] != 0; }
  // Off-diagonal stiffness of xy, xz and yz (N/m); all 0: the axes are independent.
  [[nodiscard]] std::array<float, 3> tilt(int level, VoxelId cell) const {
    const Level& l = at(level);
    return {l.tilt[0][cell], l.tilt[1][cell], l.tilt[2][cell]};
  }
  // Takes all memory and finds all springs now, not when a tick first needs them.
  void prepare_all() noexcept;
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  using Through = std::array<std::array<float, 3>, 3>;  // [axis][d] stiffness through links along d (N/m)
  // The springs that anchors add to one cell, without zeros. Only levels from LevelStiffness::kKept on have
  // records. Their springs are found on construction, because finding them row by row would take long. The
  // springs of finer levels are found when their row is first read, because all of them would take much
  // memory.
  struct Record {
    VoxelId cell;
    std::uint32_t first;  // index of its first value in Level::values
    // Bit 3·axis + d: the cell has that value. Bit 9 + axis: all of the cell is fixed on that axis.
    std::uint16_t which;
  };
  struct Level {
    LevelStiffness* couplings = nullptr;
    std::array<std::array<LazyArray<float>, 3>, 3> through;  // [axis][d][cell]
    std::array<LazyArray<float>, 3> hold, nearer;            // [axis][cell]
    LazyArray<std::uint8_t> row_held;                        // [row] values of `hold` that are not 0; kWaits
    std::array<LazyArray<float>, 3> tilt;                    // [xy, xz, yz][cell]
    LazyArray<std::uint8_t> row_tilted;  // [row] number of cells with an off-diagonal stiffness
    LazyArray<std::uint8_t> queued;      // [cell] 1: it is queued
    LazyArray<std::uint32_t> found;      // [row] lanes of a waiting row whose springs are stored
    // The records of this level, in the order of their cells; empty on levels finer than
    // LevelStiffness::kKept. `values` has the stiffnesses of all records, one record after another (N/m).
    std::vector<Record> records;
    std::vector<float> values;
  };
  static constexpr std::uint8_t kWaits = 0x80;  // bit of row_held: springs of anchors are not stored yet

  struct Found {  // springs of one cell; members as in Level
    Through through{};
    std::array<float, 3> hold{}, nearer{}, tilt{};
  };
  using Axes = std::array<bool, 3>;

  [[nodiscard]] Level& at(int level) { return levels_[static_cast<std::size_t>(level)]; }
  [[nodiscard]] const Level& at(int level) const { return levels_[static_cast<std::size_t>(level)]; }
  [[nodiscard]] Support support_of(VoxelId v) const noexcept {
    // The row is checked first, because reading supported_ may take memory.
    if ((!held_.empty() && held_mark_[v] != 0) || lattice_.anchored(v)) return kAll;
    return supports(v / kRow) ? supported_[v] : Support{};
  }
  // ---- springs of anchors ----
  void wait_for_anchors();
  void keep_records(int level);
  void find_waiting(int level, RowId row) noexcept;
  [[nodiscard]] bool waits(int level, VoxelId cell) const noexcept {
    const Level& l = at(level);
    const RowId row = cell / kRow;
    return (l.row_held[row] & kWaits) != 0 && (l.found[row] >> cell % kRow & 1U) == 0;
  }
  [[nodiscard]] std::uint32_t cells_at_anchors(int level, RowId row) const noexcept;
  [[nodiscard]] std::uint32_t voxels_at_anchors(RowId row) const noexcept;
  [[nodiscard]] std::span<const Record> records_in(int level, RowId row) const noexcept;
  [[nodiscard]] Found recorded(int level, const Record& record) const noexcept;
  [[nodiscard]] Found waiting(int level, VoxelId cell) const noexcept;

  void look_at(VoxelId v) noexcept;
  void queue(int level, VoxelId cell) noexcept;
  void renew(int level, VoxelId cell) noexcept;
  [[nodiscard]] Found find(int level, VoxelId cell) const noexcept;
  // find_first() and find_above() find the springs of a cell; complete() finds `hold` and `nearer`. `all`:
  // axes on which all of the cell is fixed.
  void find_first(VoxelId cell, Found& found, Axes& all) const noexcept;
  void find_above(int level, VoxelId cell, Found& found, Axes& all) const noexcept;
  void complete(int level, VoxelId cell, const Axes& all, Found& found) const noexcept;
  [[nodiscard]] Found known(int level, VoxelId cell) const noexcept;
  void set(int level, VoxelId cell, const Found& found) noexcept;

  const Lattice& lattice_;
  std::vector<Level> levels_;
  LazyVector<VoxelId> held_;
  LazyArray<std::uint8_t> held_mark_;         // [voxel]
  LazyArray<Support> supported_;              // [voxel]
  LazyArray<std::uint8_t> row_supported_;     // [row] 1: a voxel of it was ever supported
  std::array<LazyVector<VoxelId>, 2> queue_;  // cells to be renewed, of one level and of the next
};

}  // namespace voxel
