// SPDX-License-Identifier: GPL-3.0-or-later
// How hard what does not move holds on to the cells around it, on every coarse level: what the tool holds,
// what lies pressed on an obstacle, along its normal, and anchors.
//
// A voxel that is free and linked to one that is not is a spring from its cell to where it is. Seen from the
// middle of the next coarser cell, half a link of its level further away, that spring is in series with
// those: so a plane that is held stays where it is on every level, and a voxel held alone holds a large cell
// by about what it takes to move it in a lattice without end (3.96 of its links; Cserti, Am. J. Phys. 68,
// 2000). Each axis, and links in each direction, by themselves.
//
// (Rejected: as a disc holds on to a half-space, in units of all springs of the cell, times what kept cycles
// from swinging. Cycles left 0.85 of the error in a block of one material; and where a stiff piece was in the
// cell, too, it was held that much harder, so that layers 64 times as stiff kept 0.99. Cells that stand still
// as a whole: a brain that stands on its stem was tied to all of its coarsest cell. Cells that know nothing
// of it: a brain pressed onto the skull swung for ever.)
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
  // How a voxel is held: not, altogether, or along a normal, while it slides across that, on the tool or on
  // an obstacle.
  struct Support {
    enum class By : std::uint8_t { nothing, obstacle, tool, all } by = By::nothing;
    std::array<std::int8_t, 3> n{};  // in parts of kUnit, so that what hardly turns does not change
    bool operator==(const Support&) const = default;
    [[nodiscard]] bool slides() const { return by == By::obstacle || by == By::tool; }
  };
  static constexpr int kUnit = 127;
  [[nodiscard]] static Support along(const glm::vec3& normal, Support::By what) noexcept;
  static constexpr Support kAll{Support::By::all, {}};

  // `levels`: level 0 first; kept by the caller. Allocates.
  BoundarySprings(const Lattice& lattice, const std::vector<LevelStiffness*>& levels);

  // What the tool and other objects hold. Of more than there are surface voxels the first.
  void set_held(std::span<const VoxelId> held) noexcept;
  // So is voxel v held by its obstacle, or by the tool it slides on; takes effect with renew().
  void support(VoxelId v, const Support& by) noexcept;
  [[nodiscard]] bool supports(RowId row) const { return row_supported_[row] != 0; }
  void renew() noexcept;

  // ---- of coarse rows ----
  // Is any cell of the row held? Ask it before what follows: what anchors hold on fine levels is found when
  // it is first asked for.
  [[nodiscard]] bool any(int level, RowId row) noexcept {
    if ((at(level).row_held[row] & kWaits) != 0) find_waiting(level, row);
    return at(level).row_held[row] != 0;
  }
  // [lane] by a spring so many times as stiff as all springs of the cell.
  [[nodiscard]] const float* hold(int level, RowId row, std::size_t axis) const {
    return at(level).hold[axis].data() + static_cast<std::size_t>(row) * kRow;
  }
  // [lane] Of what it is told a cell follows by the 1 / (1 + this)th part: it is nearer to what holds it than
  // the middle of the cell that tells. (ProlongedBox all of it, cells beside an anchor overshot by as much,
  // on every level: 0.23 of the error left with three levels, and 1 with seven.)
  [[nodiscard]] const float* nearer(int level, RowId row, std::size_t axis) const {
    return at(level).nearer[axis].data() + static_cast<std::size_t>(row) * kRow;
  }
  // Tissue on an inclined surface: what holds a cell along one axis pulls it along the others, too. Each axis
  // by itself, it would be held three times too softly along the normal, and cycles near a contact swung, or
  // too hard along the surface.
  [[nodiscard]] bool tilted(int level, RowId row) const { return at(level).row_tilted[row] != 0; }
  // Off the diagonal, of xy, xz and yz, in N/m; all 0: the axes are by themselves.
  [[nodiscard]] std::array<float, 3> tilt(int level, VoxelId cell) const {
    const Level& l = at(level);
    return {l.tilt[0][cell], l.tilt[1][cell], l.tilt[2][cell]};
  }
  // Takes all memory, and finds what waits, now, not when a tick first needs it.
  void prepare_all() noexcept;
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  using Through = std::array<std::array<float, 3>, 3>;  // [axis][d] a spring, of links in d (N/m)
  // What anchors hold waits until somebody asks for its row: found for all cells, it took a quarter of what
  // the labels take above an anchored face, and forty times as much as the labels where a fifth of an object
  // is bone. On coarse levels, where it takes long to find, it is found on construction and kept as what of
  // it is not 0: most anchors hold a cell by links in one direction.
  struct Record {
    VoxelId cell;
    std::uint32_t first;  // of its values
    std::uint16_t which;  // bit 3·axis + d: through; bit 9 + axis: all of it is held
  };
  struct Level {
    LevelStiffness* couplings = nullptr;
    std::array<std::array<LazyArray<float>, 3>, 3> through;  // [axis][d][cell]
    std::array<LazyArray<float>, 3> hold, nearer;            // [axis][cell]
    LazyArray<std::uint8_t> row_held;                        // [row] how many of these are not 0, and kWaits
    std::array<LazyArray<float>, 3> tilt;                    // [xy, xz, yz][cell]
    LazyArray<std::uint8_t> row_tilted;                      // [row] cells with any
    LazyArray<std::uint8_t> queued;                          // [cell] 1: it is in its queue
    LazyArray<std::uint32_t> found;  // [row] lanes of a row that waits that do not any more
    // From LevelStiffness::kKept on, of the cells that wait or did, in their order.
    std::vector<Record> records;
    std::vector<float> values;
  };
  static constexpr std::uint8_t kWaits = 0x80;

  struct Found {  // of a cell; as in Level
    Through through{};
    std::array<float, 3> hold{}, nearer{}, tilt{};
  };
  using Axes = std::array<bool, 3>;

  [[nodiscard]] Level& at(int level) { return levels_[static_cast<std::size_t>(level)]; }
  [[nodiscard]] const Level& at(int level) const { return levels_[static_cast<std::size_t>(level)]; }
  [[nodiscard]] Support support_of(VoxelId v) const noexcept {
    // By the row first: where kernels give memory to what is only read, it took as much as what is written.
    if ((!held_.empty() && held_mark_[v] != 0) || lattice_.anchored(v)) return kAll;
    return supports(v / kRow) ? supported_[v] : Support{};
  }
  // ---- what anchors hold ----
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
  // `all`: the axes on which all of the cell is held. These find the springs, and complete() the rest.
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
  LazyArray<std::uint8_t> row_supported_;     // [row] 1: a voxel of it was
  std::array<LazyVector<VoxelId>, 2> queue_;  // cells of a level, and of the next, that are to be looked at
};

}  // namespace voxel
