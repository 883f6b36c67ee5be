// SPDX-License-Identifier: GPL-3.0-or-later
// Sweeps of ChainWave away from the sources: fast sweeping (Zhao 2005).
//
// Rows are relaxed outwards from the sources: plane by plane (z), within a plane column by column, within a
// column row by row. Each row is relaxed from the rows before it. This is the order of paths without detours.
// If a row requires a move of a row before it, a path has a detour, and the earlier row is visited again.
// Within a plane, sweeps repeat until no row is pending. Between planes, the sweep in the opposite direction
// visits the row. A visit reads and writes a row once. With a queue, the visits to its neighbours would read
// the row, too, and a detour found late would invalidate everything computed since.
#include <algorithm>
#include <utility>

#include "voxel/chain/sweep_kernel.h"
#include "voxel/chain/wave.h"

namespace voxel {

inline void ChainWave::IntRange::add(int n) noexcept {
  low = std::min(low, n);
  high = std::max(high, n);
}
inline void ChainWave::IntRange::add(const IntRange& other) noexcept {
  low = std::min(low, other.low);
  high = std::max(high, other.high);
}

// Pending rows of this column and plane, for sweeps upwards (sense 0) or downwards (1) in z.
inline ChainWave::IntRange& ChainWave::pending_range(int sense, int column, int z) noexcept {
  const Grid& grid = lattice_.grid();
  return pending_ranges_[(static_cast<std::size_t>(sense) * static_cast<std::size_t>(grid.columns) +
                          static_cast<std::size_t>(column)) *
                             (static_cast<std::size_t>(grid.dims[2]) + 2) +
                         static_cast<std::size_t>(z + 1)];
}

// Marks a row as pending when its plane is next swept upwards (sense 0) or downwards (1).
void ChainWave::mark_pending(Sweep& sweep, int sense, const std::array<int, 3>& at,
                             std::uint8_t by) noexcept {
  const RowId row = lattice_.grid().row(at[0], at[1], at[2]);
  if (!info(row).filled) return;
  pending_[row] |= by;
  pending_range(sense, at[0], at[2]).add(at[1]);
  sweep.planes[static_cast<std::size_t>(sense)].add(at[2]);
  sweep.columns.add(at[0]);
}

// Relaxes the sources' own rows and marks their neighbours as pending. False if a source's row has an anchor;
// then no sweep can start.
bool ChainWave::start_sweep(const WaveArgs& p, std::span<const Source> sources, Sweep& sweep) noexcept {
  const Grid& grid = lattice_.grid();
  std::array<IntRange, 3> box;
  for (const Source& s : sources) {
    if (info(s.v / kRow).anchored) return false;
    const std::array<int, 3> at = grid.row_coordinates(s.v / kRow);
    for (std::size_t d = 0; d < 3; ++d) box[d].add(at[d]);
  }
  sweep.column = (box[0].low + box[0].high) / 2;
  sweep.y = (box[1].low + box[1].high) / 2;
  sweep.sources = box[2];
  for (const Source& s : sources) {
    const RowId row = s.v / kRow;
    relax_within(p, row);
    const std::array<int, 3> at = grid.row_coordinates(row);
    constexpr int down = 1;
    for (std::size_t d = 0; d < 3; ++d) {
      for (const int by : {1, -1}) {
        std::array<int, 3> to = at;
        to[d] += by;
        // Pending bits: y first, then x, then z.
        const int bit = (d == 0 ? 2 : d == 1 ? 0 : 4) + (by > 0 ? 0 : 1);
        mark_pending(sweep, d == 2 && by > 0 ? 0 : down, to, static_cast<std::uint8_t>(1U << bit));
      }
    }
  }
  return true;
}

// Notes a swept strip of `count` rows from `row` (at y) on. The row after a moved row in z becomes pending.
// The rows beside it in x and the rows before it become pending if its bits in moves_ require that.
void ChainWave::note_swept(Sweep& sweep, RowId row, int y, int count) noexcept {
  const Plane& plane = sweep.plane;
  const RowId row_x = lattice_.grid().row_x, row_z = lattice_.grid().row_z;
  const RowId next = static_cast<RowId>(plane.z) * row_z, beside = static_cast<RowId>(plane.x) * row_x;
  const std::uint8_t from_z = plane.z > 0 ? kFromBelowZ : kFromAboveZ,
                     back_z = plane.z > 0 ? kFromAboveZ : kFromBelowZ,
                     from_x = plane.x > 0 ? kFromBelowX : kFromAboveX,
                     back_x = plane.x > 0 ? kFromAboveX : kFromBelowX;
  const int at_end = plane.x > 0 ? kLastMoved : kFirstMoved;
  // This looks up the RowInfo of all rows of the two lines in y beside the strip.
  (void)info(row + beside);
  (void)info(row - beside);
  // Local copies: the compiler would reload members after each byte that is written below.
  std::uint8_t* const pending = pending_.data();
  const Moved* const moves = moves_.data();
  const int step = plane.step;
  const RowId row_y = static_cast<RowId>(step);
  const float* const u = plane.u;
  const std::uint8_t* const labels = lattice_.labels(0);
  IntRange moved, pending_beside, pending_back;
  int run = 0;  // consecutive rows that moved
  const auto note_run = [&](int end) {
    if (run == 0) return;
    const int low = step > 0 ? end - run : end - 1;
    moved_.add(row + static_cast<RowId>(low * step), static_cast<RowId>(run));
    moved.add(y + (end - run) * step);
    moved.add(y + (end - 1) * step);
    run = 0;
  };
  for (int k = 0; k < count; ++k) {
    const Moved what = moves[k];
    if (what == kNothingMoved) {
      note_run(k);
      continue;
    }
    ++run;
    const RowId r = row + static_cast<RowId>(k) * row_y;
    const int at = y + k * step;
    __builtin_prefetch(u + std::size_t{r + next} * kRow);
    __builtin_prefetch(u + std::size_t{r + next} * kRow + kRow / 2);
    __builtin_prefetch(labels + std::size_t{r + next} * kRow);
    pending[r + next] |= from_z;
    if ((what & at_end) != 0 && rows_[r + beside].filled) {
      pending[r + beside] |= from_x;
      pending_beside.add(at);
    }
    if ((what & (kRevisitY | kRevisitX | kRevisitZ)) == 0) continue;
    if ((what & kRevisitY) != 0) {
      pending[r - row_y] |= step > 0 ? kFromAboveY : kFromBelowY;
      (step > 0 ? sweep.down : sweep.up).add(at - step);
    }
    if ((what & kRevisitX) != 0 && rows_[r - beside].filled) {
      pending[r - beside] |= back_x;
      pending_back.add(at);
    }
    if ((what & kRevisitZ) != 0) {
      pending[r - next] |= back_z;
      sweep.back.add(at);
    }
  }
  note_run(count);
  sweep.next.add(moved);
  const auto mark_column = [&](int x, const IntRange& span) {
    if (span.empty()) return;
    const int column = plane.column + x;
    pending_in_plane_[static_cast<std::size_t>(column)][x > 0 ? 0 : 1].add(span);
    sweep.columns.add(column);
  };
  mark_column(plane.x, pending_beside);
  mark_column(-plane.x, pending_back);
}

// Relaxes a single row that has anchors or lies beside a row with anchors. Links to rows with anchors are
// left to the queue. True if the row moved.
bool ChainWave::sweep_beside_anchor(const WaveArgs& p, Sweep& sweep, SweepTask task, RowId row,
                                    int y) noexcept {
  const auto number = [this](const RowInfo* info) { return static_cast<RowId>(info - rows_.data()); };
  const std::array<RowId, 3> from{number(task.own.info - task.step),
                                  task.z.u != nullptr ? number(task.z.info) : 0, number(task.x.info)};
  pending_[row] &= static_cast<std::uint8_t>(~task.mask);
  if (rows_[row].anchored) {
    for (const RowId r : from) {
      if (moved_.has(r)) enqueue(r);
    }
    return false;
  }
  task.y = !rows_[from[0]].anchored;
  if (rows_[from[1]].anchored) task.z = {};
  if (rows_[from[2]].anchored) task.x = {};
  task.mask = 0xFF;
  task.count = task.max_rows = 1;
  std::uint8_t pending = 1;
  task.pending = &pending;
  (p.way == Way::raise ? sweep_raise : sweep_lower)(task, 1, moves_.data());
  if (moves_.front() == kNothingMoved) return false;
  note_swept(sweep, row, y, 1);
  enqueue(row);
  return true;
}

// Relaxes the pending rows of `span`, and rows that follow a moved row, upwards or downwards in y.
void ChainWave::sweep_strip(const WaveArgs& p, Sweep& sweep, int step, const IntRange& span) noexcept {
  if (span.empty()) return;
  const Grid& grid = lattice_.grid();
  Plane& plane = sweep.plane;
  plane.step = step;
  SweepTask task = sweep.task;
  task.step = step;
  const auto half = [&p](int n) { return p.limits.half[static_cast<std::size_t>(n)]; };
  task.along_y = step > 0 ? LinkHalves{half(2), half(3)} : LinkHalves{half(3), half(2)};
  task.mask = static_cast<std::uint8_t>((step > 0 ? kFromBelowY : kFromAboveY) |
                                        (plane.x > 0 ? kFromBelowX : kFromAboveX) |
                                        (plane.z > 0 ? kFromBelowZ : kFromAboveZ));
  int y = step > 0 ? span.low : span.high;
  bool moved_before = false;
  task.count = span.high - span.low + 1;
  task.max_rows = step > 0 ? grid.dims[1] - y : y + 1;
  while (task.max_rows > 0 && (moved_before || task.count > 0)) {
    const RowId row = grid.row(plane.column, y, plane.at);
    const auto strip = [&](RowId r) { return RowStrip{row_at(p, r), lattice_.labels(r), &info(r)}; };
    task.own = strip(row);
    const int from_z = plane.at - plane.z;
    task.z = from_z >= 0 && from_z < grid.dims[2] ? strip(row - static_cast<RowId>(plane.z) * grid.row_z)
                                                  : RowStrip{};
    task.x = strip(row - static_cast<RowId>(plane.x) * grid.row_x);
    task.pending = &pending_[row];
    const bool by_anchor = task.own.info->anchored || (task.z.u != nullptr && task.z.info->anchored) ||
                           task.x.info->anchored || (task.own.info - step)->anchored;
    SweepResult done{1, 1};
    if (by_anchor && (moved_before || (pending_[row] & task.mask) != 0)) {
      moved_before = sweep_beside_anchor(p, sweep, task, row, y);
    } else {
      // A row after a moved row is pending, too.
      if (moved_before) pending_[row] |= task.mask;
      const std::uint64_t left = sweep.most - std::min(sweep.most, sweep.visits);
      const int most = static_cast<int>(std::min<std::uint64_t>(left, 1U << 30U));
      done = (p.way == Way::raise ? sweep_raise : sweep_lower)(task, most, moves_.data());
      note_swept(sweep, row, y, done.end);
      moved_before = done.end > 0 && moves_[static_cast<std::size_t>(done.end - 1)] != kNothingMoved;
      if (done.visits >= most) sweep.stopped = true;
    }
    sweep.visits += static_cast<std::uint64_t>(done.visits);
    task.count -= done.end;
    task.max_rows -= done.end;
    y += done.end * step;
    if (sweep.stopped) {
      if (moved_before && task.max_rows > 0) pending_[grid.row(plane.column, y, plane.at)] |= task.mask;
      sweep.rest.add({std::min(span.low, y), std::max(span.high, y)});
      return;
    }
  }
}

// Sweeps the rows of one column in a plane: from the middle of the sources upwards and downwards in y,
// repeated until none is pending.
void ChainWave::sweep_column(const WaveArgs& p, Sweep& sweep, int column, int x,
                             const IntRange& span) noexcept {
  Plane& plane = sweep.plane;
  plane.column = column;
  plane.x = x;
  const auto half = [&p](int n) { return p.limits.half[static_cast<std::size_t>(n)]; };
  sweep.task.along_x = x > 0 ? LinkHalves{half(0), half(1)} : LinkHalves{half(1), half(0)};
  sweep.task.x_above = x < 0;
  sweep.next = sweep.back = {};
  // Beside the sources any neighbour may have moved; elsewhere only those in the plane or column before.
  const bool at_sources = plane.at >= sweep.sources.low - 1 && plane.at <= sweep.sources.high + 1;
  sweep.up = {};
  sweep.down = {span.low, at_sources ? span.high : std::min(sweep.y - 1, span.high)};
  if (at_sources) sweep.up = span;
  sweep_strip(p, sweep, 1, {std::max(sweep.y, span.low), span.high});
  while (!sweep.stopped && !(sweep.up.empty() && sweep.down.empty())) {
    sweep_strip(p, sweep, -1, std::exchange(sweep.down, {}));
    if (sweep.stopped) break;
    sweep_strip(p, sweep, 1, std::exchange(sweep.up, {}));
  }
  if (sweep.stopped) {
    sweep.rest.add(sweep.up);
    sweep.rest.add(sweep.down);
    sweep.rest.add(span);
    pending_range(plane.z > 0 ? 0 : 1, column, plane.at).add(sweep.rest);
    sweep.planes[plane.z > 0 ? 0 : 1].add(plane.at);
  }
  const auto pass_to_plane = [&](int z, int sense, const IntRange& rows) {
    if (rows.empty() || z < 0 || z >= lattice_.grid().dims[2]) return;
    pending_range(sense, column, z).add(rows);
    sweep.planes[static_cast<std::size_t>(sense)].add(z);
  };
  pass_to_plane(plane.at + plane.z, plane.z > 0 ? 0 : 1, sweep.next);
  pass_to_plane(plane.at - plane.z, plane.z > 0 ? 1 : 0, sweep.back);
}

// Sweeps the columns of one plane, outwards in x and repeated until none is pending.
void ChainWave::sweep_plane(const WaveArgs& p, Sweep& sweep, int z, int by) noexcept {
  const int sense = by > 0 ? 0 : 1;
  sweep.plane.at = z;
  sweep.plane.z = by;
  const auto half = [&p](int n) { return p.limits.half[static_cast<std::size_t>(n)]; };
  sweep.task.along_z = by > 0 ? LinkHalves{half(4), half(5)} : LinkHalves{half(5), half(4)};
  int begin = std::clamp(sweep.column, sweep.columns.low, sweep.columns.high);
  const bool at_sources = z >= sweep.sources.low - 1 && z <= sweep.sources.high + 1;
  for (int c = sweep.columns.low; c <= sweep.columns.high; ++c) {
    const IntRange span = std::exchange(pending_range(sense, c, z), {});
    pending_in_plane_[static_cast<std::size_t>(c)] = {at_sources || c >= begin ? span : IntRange{},
                                                      at_sources || c < begin ? span : IntRange{}};
  }
  const auto swept = [&](int column, int x) {
    const IntRange span =
        std::exchange(pending_in_plane_[static_cast<std::size_t>(column)][x > 0 ? 0 : 1], {});
    if (span.empty()) return false;
    sweep_column(p, sweep, column, x, span);
    return true;
  };
  for (bool any = true; any && !sweep.stopped; begin = sweep.columns.low) {
    any = false;
    for (int c = begin; c <= sweep.columns.high && !sweep.stopped; ++c) any = swept(c, 1) || any;
    for (int c = sweep.columns.high; c >= sweep.columns.low && !sweep.stopped; --c) any = swept(c, -1) || any;
  }
  for (int c = sweep.columns.low; sweep.stopped && c <= sweep.columns.high; ++c) {
    for (IntRange& span : pending_in_plane_[static_cast<std::size_t>(c)])
      pending_range(sense, c, z).add(std::exchange(span, {}));
  }
  if (sweep.stopped) sweep.planes[static_cast<std::size_t>(sense)].add(z);
}

// After a stopped sweep, a row has to wait if its links to a pending row are yet to be relaxed.
void ChainWave::stop_sweep(const WaveArgs& p, Sweep& sweep) noexcept {
  const Grid& grid = lattice_.grid();
  const std::array<RowId, 6> from{1, ~RowId{0}, grid.row_x, ~grid.row_x + 1, grid.row_z, ~grid.row_z + 1};
  for (int sense = 0; sense < 2; ++sense) {
    const IntRange planes = sweep.planes[static_cast<std::size_t>(sense)];
    for (int z = planes.low; z <= planes.high; ++z) {
      for (int c = sweep.columns.low; c <= sweep.columns.high; ++c) {
        const IntRange span = std::exchange(pending_range(sense, c, z), {});
        for (int y = std::max(span.low, 0); y <= std::min(span.high, grid.dims[1] - 1); ++y) {
          const RowId row = grid.row(c, y, z);
          for (std::size_t n = 0; n < from.size(); ++n) {
            if ((pending_[row] >> n & 1U) != 0 && info(row - from[n]).filled)
              postpone(row - from[n], wave_bit(p.axis, p.way));
          }
          pending_[row] = 0;
        }
      }
    }
  }
}

// Moves the voxels that must follow the sources, which are at their new places already. False if no sweep is
// possible. Then the queue must move them.
bool ChainWave::sweep(const WaveArgs& p, std::span<const Source> sources, std::uint64_t most,
                      std::uint64_t& visits) noexcept {
  Sweep sweep;
  if (most < kMinSweepBudget || !start_sweep(p, sources, sweep)) return false;
  sweep.most = most - kMinSweepBudget / 2;
  sweep.task.margin = p.margin;
  sweep.plane.u = p.u;
  sweep.task.registers = limits_.registers();
  sweep.task.up = p.limits.half[0];
  sweep.task.down = p.limits.half[1];
  while (!sweep.stopped && !(sweep.planes[0].empty() && sweep.planes[1].empty())) {
    for (const int by : {-1, 1}) {
      const std::size_t sense = by > 0 ? 0 : 1;
      IntRange& planes = sweep.planes[sense];
      for (int z = by > 0 ? planes.low : planes.high; !sweep.stopped && z >= planes.low && z <= planes.high;
           z += by)
        sweep_plane(p, sweep, z, by);
      if (!sweep.stopped) planes = {};
    }
  }
  visits += sweep.visits;
  work_ += sweep.visits;
  if (sweep.stopped) {
    stop_sweep(p, sweep);
    // The surroundings of the sources are settled in any case.
    for (const Source& s : sources) enqueue(s.v / kRow);
    visits += run_queue(p, kMinSweepBudget / 2);
  }
  return true;
}

}  // namespace voxel
