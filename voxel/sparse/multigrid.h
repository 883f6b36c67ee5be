// SPDX-License-Identifier: GPL-3.0-or-later
// The passes of which a multigrid cycle is made, row by row; which rows, and when, is Relaxation's business.
//
// Full approximation scheme (Brandt 1977; Briggs, Henson & McCormick, A Multigrid Tutorial, chapter 6): a
// coarse cell holds the whole displacement, not a correction. So a neighbourhood of the contact can be
// solved on all levels in a tick while fine voxels further away are still where they were: the coarse cells
// there go on, and the voxels follow when their turn comes.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "voxel/sparse/couplings.h"
#include "voxel/sparse/displacement.h"
#include "voxel/sparse/lattice.h"
#include "voxel/sparse/links.h"
#include "voxel/sparse/row_kernels.h"

namespace voxel::sparse {

class Multigrid {
 public:
  explicit Multigrid(const Lattice& lattice);

  [[nodiscard]] int levels() const { return static_cast<int>(levels_.size()); }
  [[nodiscard]] const Grid& grid(int level) const { return at(level).couplings->grid(); }
  // The springs of the voxels' links.
  [[nodiscard]] Couplings& couplings() { return *at(0).couplings; }

  // What is known of a row.
  enum Flag : std::uint8_t {
    active = 1,   // its residual may be too large
    dirty = 2,    // it, or a row beside it, changed since it was passed on to the next coarser level
    changed = 4,  // (coarse) it changed since what it holds was told
    loud = 8,     // (coarse) what is being told is too large to leave out
  };
  [[nodiscard]] bool has(int level, RowId row, std::uint8_t flag) const {
    return (at(level).flags[row] & flag) != 0;
  }
  // May any row of a plane (rows of one column and z: row / grid.row_z) have it?
  [[nodiscard]] bool plane_has(int level, RowId plane, std::uint8_t flag) const {
    return (at(level).plane_flags[plane] & flag) != 0;
  }
  void clear_plane(int level, RowId plane, std::uint8_t flag) noexcept {
    at(level).plane_flags[plane] &= static_cast<std::uint8_t>(~flag);
  }
  void mark(int level, RowId row, std::uint8_t flag) noexcept;
  void unmark(int level, RowId row, std::uint8_t flag) noexcept {
    at(level).flags[row] &= static_cast<std::uint8_t>(~flag);
  }
  // Somebody moved voxels of this row: it and the rows beside it are to be looked at.
  void stir(int level, RowId row) noexcept { spread(level, row, active | dirty); }

  // What the tool and other objects hold does not move, nor do the cells around it on coarser levels.
  void set_held(std::span<const VoxelId> held) noexcept;
  // Held voxels hold the cells above them as many times harder: what a cycle that overshot asks for.
  void set_hold(float times) noexcept { hold_ = times; }
  // Cells held because a chain at its limit holds a voxel in them, until this is called.
  void release_limited() noexcept;

  // Is there anything in the row? Call it before any of what follows.
  bool prepare(int level, RowId row) noexcept { return at(level).couplings->prepare(row); }

  // Moves the voxels, or cells, of a row to the minimum of their energy given all other rows, every second
  // one first, without leaving their limits.
  void smooth(int level, RowId row, Displacement& state, const ObstacleView& obstacles) noexcept;
  // The cells of a coarse row take the means of what they hold, and keep what they know beyond that …
  void restrict_values(int level, RowId row, const Displacement& state) noexcept;
  // … and the load under which those would be at rest where they are. Returns the largest force left on any
  // voxel below (N); only for level 1 is it one of voxels.
  float restrict_loads(int level, RowId row, const Displacement& state,
                       const ObstacleView& obstacles) noexcept;
  // Sets aside what a coarse row has to tell, for prolong(): that row is told.
  void begin_telling(int level, RowId row) noexcept;
  // Passes on to a row what the next coarser one has set aside; or, `now`, what it knows beyond what it told,
  // which end_telling() then takes as told.
  void prolong(int level, RowId row, bool now, Displacement& state, const ObstacleView& obstacles) noexcept;
  void end_telling(int level, RowId row) noexcept;
  // The most that any cell of a coarse row has yet to tell (m).
  [[nodiscard]] float untold(int level, RowId row) const noexcept;
  // Puts a row where the next coarser level says it is; what finer detail it had is forgotten.
  void follow_coarse(int level, RowId row, Displacement& state, const ObstacleView& obstacles) noexcept;

  // Rows whose voxels are pulled by less than `tolerance_N`, or whose cells would move less than `quiet_m`,
  // are left alone.
  void set_quiet(float tolerance_N, float quiet_m) noexcept {
    tolerance_N_ = tolerance_N;
    quiet_m_ = quiet_m;
  }
  void copy_from(const Multigrid& other) noexcept;
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct Level {
    std::unique_ptr<Couplings> couplings;
    // [axis][cell]; those of level 0 are elsewhere. `told` is the value that what the cell holds knows of, so
    // value − told is what it has yet to hear; `telling` is such a difference set aside.
    std::array<LazyArray<float>, 3> value, told, load, telling;
    LazyArray<std::uint8_t> stopped;      // [cell or voxel] bits 0 to 2: held by a limit on that axis
    LazyArray<std::uint16_t> held;        // [cell] voxels in it that the tool or another object holds
    LazyArray<std::uint8_t> row_held;     // [row] 1: some cell of it has one of these
    LazyArray<std::uint8_t> flags;        // [row]
    LazyArray<std::uint8_t> plane_flags;  // [row / row_z]
  };
  struct HeldCell {
    std::uint8_t level;
    VoxelId cell;
  };

  [[nodiscard]] Level& at(int level) { return levels_[static_cast<std::size_t>(level)]; }
  [[nodiscard]] const Level& at(int level) const { return levels_[static_cast<std::size_t>(level)]; }
  [[nodiscard]] float* values(int level, int axis, Displacement& state) noexcept {
    return (level == 0 ? state.u : at(level).value)[static_cast<std::size_t>(axis)].data();
  }
  [[nodiscard]] const float* values(int level, int axis, const Displacement& state) const noexcept {
    return (level == 0 ? state.u : at(level).value)[static_cast<std::size_t>(axis)].data();
  }
  void spread(int level, RowId row, std::uint8_t flags) noexcept;
  void note_change(int level, RowId row, float change) noexcept;
  void stop_cells(VoxelId v, std::uint8_t bits) noexcept;
  void keep_held(int level, RowId row, int axis, float* wanted) const noexcept;
  void smooth_voxels(RowId row, Displacement& state, const ObstacleView& obstacles) noexcept;
  void smooth_cells(int level, RowId row) noexcept;
  void mean_of_children(int level, RowId row, int axis, const Displacement& state, Row& out) noexcept;
  float residual_of(int level, RowId row, int axis, const Displacement& state, const ObstacleView& obstacles,
                    Row& out) noexcept;
  void correct_voxels(RowId row, int axis, Row& correction, Displacement& state) noexcept;
  enum class Of : std::uint8_t { set_aside, untold, values };
  void interpolate(int level, RowId row, int axis, Of of, Row& out) noexcept;
  void correct(int level, RowId row, int axis, Row& correction, Displacement& state) noexcept;
  void clear_obstacles(RowId row, Displacement& state, const ObstacleView& obstacles) noexcept;
  [[nodiscard]] bool rows_below(int level, RowId row, int child, RowId& fine) const noexcept;

  const Lattice& lattice_;
  std::vector<Level> levels_;
  std::vector<HeldCell> held_, stopped_;
  std::array<AxisLimits, 3> limits_;
  float tolerance_N_ = 0.0F, quiet_m_ = 0.0F, hold_ = 1.0F;
};

}  // namespace voxel::sparse
