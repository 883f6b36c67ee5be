// SPDX-License-Identifier: GPL-3.0-or-later
// The innermost loops of relaxation: all three axes of one row at once, in vectors. Pure functions of memory;
// which rows, and what follows from it, is Multigrid's business.
//
// They go by octets of lanes, so that a contact narrower than a row costs no more than it is wide.
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
  std::ptrdiff_t z = 0, x = 0;         // floats to the row beside it in z, and in x; kRow in y
  RowStiffness springs;
  const std::uint8_t* held = nullptr;     // [lane] bit 0: does not move; null: all may
  const std::uint8_t* stopped = nullptr;  // [lane] bit `axis`: does not move on that axis; null: all may
  // [axis] A spring to `held_at`, as many times as stiff as all links of the cell; all null: none has one.
  std::array<const float*, 3> hold{};
  std::array<const float*, 3> held_at{};
  float hold_times = 1.0F;
};

// Moves the voxels, or cells (`limits` null), of a row to the minimum of their energy given the rows around,
// every second one first. Returns the longest way of any (m).
float smooth_row(const LevelRow& row, const RowLimits* limits, LaneSpan span) noexcept;

using RowVector = std::array<Lanes, 3>;  // [axis][lane]

struct RowResidual {
  float most_N = 0.0F, most_way_m = 0.0F;   // the largest force left, and the furthest that any would move
  std::array<std::uint32_t, 3> resisted{};  // [axis] lanes that pull against a limit: they count as at rest
};

// What its links, and its load, pull each voxel of a row with that may move (N); 0 for others.
// Nearer to its limit than `tight_m` a link is at it.
RowResidual residual_row(const LevelRow& row, const RowLimits* limits, float tight_m, LaneSpan span,
                         RowVector& out) noexcept;
// The same for what somebody changed in `out` afterwards.
void measure_row(const RowStiffness& springs, const RowVector& residual, LaneSpan span,
                 RowResidual& out) noexcept;

// Adds neighbouring lanes of a finer row, of one axis, to half of a coarse row: its octets span.first/2 …
void add_pairs(const float* fine, LaneSpan span, float* half) noexcept;

// From the sums of what the cells of a coarse row hold: their means, and what they know beyond those.
void take_means(const RowVector& sums, const float* share, const std::array<float*, 3>& value,
                const std::array<float*, 3>& told, LaneSpan span) noexcept;
// load = force − Σ k (told(neighbour) − told); `row.u` are the values told.
void take_loads(const LevelRow& row, const RowVector& force, const std::array<float*, 3>& load,
                LaneSpan span) noexcept;
// Of the lanes first … last of a coarse row, which may go beyond it: out = value − told, 0 in others of the
// span; told = value.
void take_pending_correction(const float* value, float* told, const float* filled, LaneSpan span, int first,
                             int last, float* out) noexcept;
// From cells to the lanes of the finer level, along x: 3/4 of the cell a lane is in, 1/4 of the nearer
// neighbour. Of the octets before and after `cells` the nearest lane is read.
void spread_along(const float* cells, int octets, float* lanes) noexcept;
// Is every one of these lanes 1?
bool all_ones(const float* lanes, int octets) noexcept;

// What the four coarse rows around a fine one tell it, own cell's first, then the nearer in y, in z, in both;
// spread along x.
struct ProlongedRow {
  std::array<const float*, 3> sum{};  // [axis][lane]
  const float* weight = nullptr;      // [lane] of what there is of its cells; null: all of them
  bool is_source = false;             // else it weighs, but adds nothing
};
// Their sum, with cell-centred trilinear weights: 3/4 to the cell a voxel is in, 1/4 to the nearer neighbour,
// on each axis; an empty neighbour's share goes to the others (a free surface). The rows' lanes begin with
// the span's.
void sum_interpolated(const std::array<ProlongedRow, 4>& rows, LaneSpan span, RowVector& out) noexcept;
// From the sums over what cells hold: value and told less their means.
void take_back(const RowVector& sums, const float* share, const std::array<float*, 3>& value,
               const std::array<float*, 3>& told, LaneSpan span) noexcept;
// The largest |a[i] − b[i]| of one axis, of the lanes of the span that lie in first … last.
float row_difference(const float* a, const float* b, LaneSpan span, int first, int last) noexcept;

// way = now − was of one axis of a row; returns the longest.
float row_way(const float* now, const float* was, float* way) noexcept;

// Links of a row of voxels on one axis, and what they pull at it; bits are lanes.
struct LinksAtLimits {
  // [d] of the link up, and of the link down: the difference can be no less, no more.
  std::array<std::uint32_t, 3> at_low, at_high, down_at_low, down_at_high;
  std::uint32_t pulled_up, pulled_down;
  std::uint32_t movable;  // not anchored
  Lanes pull_N;           // of links and loads
};
// Of `row` only that axis is read. Nearer to its limit than `tight_m` [d] a link is at it.
void links_at_limits(const LevelRow& row, const RowLimits& limits, std::size_t axis,
                     const std::array<float, 3>& tight_m, LinksAtLimits& out) noexcept;

struct RowCorrection {
  float most_m = 0.0F;   // the most that any voxel was asked to move
  unsigned refused = 0;  // bit of each axis on which some did not follow all the way
};
// Adds a correction to a row as far as its links allow. `refused`: where the bit is set, what was left of it
// in the lanes of the span; of what is held or anchored nothing is expected.
RowCorrection correct_row(const LevelRow& row, const RowLimits* limits, LaneSpan span,
                          const RowVector& correction, RowVector& refused) noexcept;

// ---- of a joint move (limited_correction_rows.cpp) ----
// What lies beside a row, bit by bit.
enum Side : unsigned { kYDown = 1, kYUp = 2, kZDown = 4, kZUp = 8, kXDown = 16, kXUp = 32 };

struct SetOut {
  float most_m = 0.0F;   // the most that any voxel was asked to move
  bool cut = false;      // something that stands was to go
  bool beyond = false;   // links may be beyond their limits: within the row, or to one of its `sides`
  unsigned stopped = 0;  // bit of each axis on which something that `row.stopped` stops was to
};
// Adds `way` to a row whatever its links allow, but to what stands and to what is stopped; in `way` stands
// then where the row was. `refused`: where anything is stopped, the ways of that in the lanes of the span.
SetOut set_out_row(const LevelRow& row, const RowLimits& limits, LaneSpan span, unsigned sides,
                   RowVector& way, RowVector& refused) noexcept;
// May links within a row, or to one of its sides, be beyond their limits?
bool may_be_beyond(const LevelRow& row, const RowLimits& limits, unsigned sides) noexcept;
// Bit of each axis on which links may be beyond their limits.
unsigned axes_beyond(const LevelRow& row, const RowLimits& limits) noexcept;
// On these axes voxels of a row that are beyond a limit of a link, by more than floats round, come back
// towards `from`, as far as that asks and no further. True where any did.
bool draw_back_row(const LevelRow& row, const RowLimits& limits, unsigned axes,
                   const RowVector& from) noexcept;

}  // namespace voxel
