// SPDX-License-Identifier: GPL-3.0-or-later
// Inner loops of relaxation on all three axes of one row, in vectors. They only read and write the given
// memory: Multigrid decides which rows they process, and what follows.
//
// They work on spans of Float8, so that a contact narrower than a row costs no more than its width.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "voxel/lattice/level_stiffness.h"
#include "voxel/lattice/row_grid.h"
#include "voxel/lattice/simd8.h"

namespace voxel {

// One row of a level.
struct LevelRow {
  std::array<float*, 3> u{};           // [axis] its first value (unit: meter)
  std::array<const float*, 3> load{};  // (N); null: none
  std::ptrdiff_t z = 0, x = 0;         // floats to the next row in z, and in x; kRow in y
  RowStiffness springs;
  const std::uint8_t* held = nullptr;  // [lane] bit 0: does not move; null: all may
  // [lane] bit `axis`: an active limit holds it on that axis; null: none
  const std::uint8_t* stopped = nullptr;
  // [axis] Boundary springs; all null if there are none. `hold`: their stiffness divided by that of all links
  // of the cell; it still has to be multiplied by hold_times. `held_at`: the displacement towards which they
  // pull (m).
  std::array<const float*, 3> hold{};
  std::array<const float*, 3> held_at{};
  float hold_times = 1.0F;
};

// Moves every second voxel or cell of a row, then the others, each to the minimum of its energy. For cells
// `limits` is null. The rows around stay fixed. Returns the largest motion (m).
float smooth_row(const LevelRow& row, const RowLimits* limits, LaneSpan span) noexcept;

using RowVector = std::array<Lanes, 3>;  // [axis][lane]

struct RowResidual {
  float most_N = 0.0F, most_way_m = 0.0F;  // largest residual, and the largest motion that a lane would make
  // [axis] lanes that pull against an active limit; their residual counts as 0
  std::array<std::uint32_t, 3> resisted{};
};

// Residual of each lane that may move: force of links, load and boundary springs (N); 0 for others. A link
// nearer to its limit than `tight_m` counts as being at its limit.
RowResidual residual_row(const LevelRow& row, const RowLimits* limits, float tight_m, LaneSpan span,
                         RowVector& out) noexcept;
// Renews the maxima in `out` after `residual` was changed.
void measure_row(const RowStiffness& springs, const RowVector& residual, LaneSpan span,
                 RowResidual& out) noexcept;

// Adds each pair of lanes of a finer row to the lane above it, on one axis. `half`: the half of the coarse
// row that lies above the finer row. Its first Float8 to change is number span.first / 2.
void add_pairs(const float* fine, LaneSpan span, float* half) noexcept;

// Sets `prolonged` to the means of the children, whose sums are given. `value` keeps its pending correction.
void take_means(const RowVector& sums, const float* share, const std::array<float*, 3>& value,
                const std::array<float*, 3>& prolonged, LaneSpan span) noexcept;
// FAS load: load = force − Σ k (prolonged(neighbour) − prolonged); row.u is `prolonged`.
void take_loads(const LevelRow& row, const RowVector& force, const std::array<float*, 3>& load,
                LaneSpan span) noexcept;
// In lanes first … last of a coarse row: out = filled · (value − prolonged), then prolonged = value. These
// lanes may extend beyond the row. `out` is 0 in the span's other lanes.
void take_pending_correction(const float* value, float* prolonged, const float* filled, LaneSpan span,
                             int first, int last, float* out) noexcept;
// Interpolation along x from cells to lanes of the finer level: 3/4 of the own cell, 1/4 of the nearer
// neighbour. Reads the nearest lane of the Float8 before and after `cells`.
void spread_along(const float* cells, int groups, float* lanes) noexcept;
// Are all of these lanes 1?
bool all_ones(const float* lanes, int groups) noexcept;

// One of the four coarse rows around a fine one, interpolated along x. Their order: own, nearer in y, nearer
// in z, nearer in both.
struct ProlongedRow {
  std::array<const float*, 3> sum{};  // [axis][lane]
  const float* weight = nullptr;      // [lane] weight of the cells that exist; null: all exist
  bool is_source = false;             // false: it has weight, but no correction
};
// Cell-centred trilinear prolongation: 3/4 of the own cell, 1/4 of the nearer neighbour, on each axis. The
// weight of a missing neighbour goes to the others (a free surface). The lanes of `rows` begin with those of
// the span.
void sum_interpolated(const std::array<ProlongedRow, 4>& rows, LaneSpan span, RowVector& out) noexcept;
// Subtracts the children's means from value and prolonged.
void take_back(const RowVector& sums, const float* share, const std::array<float*, 3>& value,
               const std::array<float*, 3>& prolonged, LaneSpan span) noexcept;
// Largest |a[i] − b[i]| of one axis, over the lanes of the span between `first` and `last`.
float row_difference(const float* a, const float* b, LaneSpan span, int first, int last) noexcept;

// way = now − was of one axis of a row; returns the largest |way|.
float row_way(const float* now, const float* was, float* way) noexcept;

// For one axis of a row of voxels: the links that are at their limits, and the forces on the voxels. The bits
// of a mask are lanes.
struct LinksAtLimits {
  // [d] lanes whose link up along d has its difference at the lower limit (at_low) or at the upper limit
  // (at_high). down_at_low, down_at_high: lanes whose link down along d is at its lower or upper limit.
  std::array<std::uint32_t, 3> at_low, at_high, down_at_low, down_at_high;
  std::uint32_t pulled_up, pulled_down;
  std::uint32_t movable;  // not anchored
  Lanes pull_N;           // force of links and loads
};
// Only `axis` of `row` is read. A link nearer to its limit than tight_m[d] counts as being at its limit.
void links_at_limits(const LevelRow& row, const RowLimits& limits, std::size_t axis,
                     const std::array<float, 3>& tight_m, LinksAtLimits& out) noexcept;

struct RowCorrection {
  float most_m = 0.0F;   // largest motion asked of a voxel
  unsigned refused = 0;  // bits of the axes on which some voxel did not follow all the way
};
// Adds a correction to a row as far as its links allow. On axes whose bit is set in the result, `refused`
// becomes the rest of the correction in the lanes of the span; it is 0 for held and anchored voxels.
RowCorrection correct_row(const LevelRow& row, const RowLimits* limits, LaneSpan span,
                          const RowVector& correction, RowVector& refused) noexcept;

// ---- limited corrections (limited_correction_rows.cpp) ----
// Sides of a row, as bits.
enum Side : unsigned { kYDown = 1, kYUp = 2, kZDown = 4, kZUp = 8, kXDown = 16, kXUp = 32 };

struct SetOut {
  float most_m = 0.0F;  // largest motion asked of a voxel
  bool cut = false;     // a voxel that does not move was asked to move
  bool beyond = false;  // links in the row, or to one of its `sides`, may be beyond their limits
  // bits of the axes on which an active limit (row.stopped) holds a voxel that was asked to move
  unsigned stopped = 0;
};
// Adds `way` to the lanes of the span, whatever the links allow. Held, anchored and stopped voxels stay. On
// return `way` holds the displacements before the call. If the row has stopped voxels (row.stopped),
// `refused` is the motion that was asked of them; it is 0 in the span's other lanes.
SetOut set_out_row(const LevelRow& row, const RowLimits& limits, LaneSpan span, unsigned sides,
                   RowVector& way, RowVector& refused) noexcept;
// May links in a row, or to one of its sides, be beyond their limits?
bool may_be_beyond(const LevelRow& row, const RowLimits& limits, unsigned sides) noexcept;
// Bits of the axes on which links may be beyond their limits.
unsigned axes_beyond(const LevelRow& row, const RowLimits& limits) noexcept;
// On these axes, moves voxels with a link beyond its limit (by more than rounding) back towards `from`, as
// far as needed. True if any moved.
bool draw_back_row(const LevelRow& row, const RowLimits& limits, unsigned axes,
                   const RowVector& from) noexcept;

}  // namespace voxel
