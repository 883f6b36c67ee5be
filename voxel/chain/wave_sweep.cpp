// SPDX-License-Identifier: GPL-3.0-or-later
// Of ChainWave: sweeps away from the sources.
//
// Plane by plane (z), and in each column by column and row by row, outwards from the sources, rows take what
// the rows before them ask: fast sweeping (Zhao 2005), in the order that paths without detour have. What
// detours add shows when a row asks one before it: then it is that one's turn again, within a plane at once,
// until nothing is asked there any more, and between planes on the way back. A row is read once and written
// once for each visit; in the queue it is read by each of its neighbours, and a detour found late runs
// through all that was done since.
#include <algorithm>
#include <utility>

#include "voxel/chain/sweep_kernel.h"
#include "voxel/chain/wave.h"

namespace voxel {

inline void ChainWave::Span::add(int n) noexcept {
  low = std::min(low, n);
  high = std::max(high, n);
}
inline void ChainWave::Span::add(const Span& other) noexcept {
  low = std::min(low, other.low);
  high = std::max(high, other.high);
}

// Rows of this column and plane that are asked from below (0) or above (1), or from within the plane.
inline ChainWave::Span& ChainWave::asked_span(int way, int column, int z) noexcept {
  const Grid& grid = lattice_.grid();
  return asked_spans_[(static_cast<std::size_t>(way) * static_cast<std::size_t>(grid.columns) +
                       static_cast<std::size_t>(column)) *
                          (static_cast<std::size_t>(grid.dims[2]) + 2) +
                      static_cast<std::size_t>(z + 1)];
}

// It is this row's turn when its plane is next swept upwards (0) or downwards (1).
void ChainWave::ask_row(Sweep& sweep, int way, const std::array<int, 3>& at, std::uint8_t by) noexcept {
  const RowId row = lattice_.grid().row(at[0], at[1], at[2]);
  if (!info(row).filled) return;
  asked_[row] |= by;
  asked_span(way, at[0], at[2]).add(at[1]);
  sweep.planes[static_cast<std::size_t>(way)].add(at[2]);
  sweep.columns.add(at[0]);
}

// The sources' own rows, and whom they ask. False where no sweep may begin: an anchor is among them, or they
// are far apart.
bool ChainWave::begin_sweep(const Pass& p, std::span<const Source> sources, Sweep& sweep) noexcept {
  const Grid& grid = lattice_.grid();
  std::array<Span, 3> box;
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
    ask_along(p, row);
    const std::array<int, 3> at = grid.row_coordinates(row);
    constexpr int down = 1;
    for (std::size_t d = 0; d < 3; ++d) {
      for (const int by : {1, -1}) {
        std::array<int, 3> to = at;
        to[d] += by;
        // Bits of x stand after those of y.
        const int bit = (d == 0 ? 2 : d == 1 ? 0 : 4) + (by > 0 ? 0 : 1);
        ask_row(sweep, d == 2 && by > 0 ? 0 : down, to, static_cast<std::uint8_t>(1U << bit));
      }
    }
  }
  return true;
}

// Of `count` rows from `row` on, y upwards or downwards, those that moved ask the rows after them in z, and
// whoever moves_ says.
void ChainWave::note_pulled(Sweep& sweep, RowId row, int y, int count) noexcept {
  const Plane& plane = sweep.plane;
  const RowId row_x = lattice_.grid().row_x, row_z = lattice_.grid().row_z;
  const RowId next = static_cast<RowId>(plane.z) * row_z, beside = static_cast<RowId>(plane.x) * row_x;
  const std::uint8_t from_z = plane.z > 0 ? kFromBelowZ : kFromAboveZ,
                     back_z = plane.z > 0 ? kFromAboveZ : kFromBelowZ,
                     from_x = plane.x > 0 ? kFromBelowX : kFromAboveX,
                     back_x = plane.x > 0 ? kFromAboveX : kFromBelowX;
  const int at_end = plane.x > 0 ? kLastMoved : kFirstMoved;
  // All rows of a line are looked up together.
  (void)info(row + beside);
  (void)info(row - beside);
  // At hand here: after each byte that is written below, members would be read again.
  std::uint8_t* const asked = asked_.data();
  const Moved* const moves = moves_.data();
  const int step = plane.step;
  const RowId row_y = static_cast<RowId>(step);
  const float* const u = plane.u;
  const std::uint8_t* const labels = lattice_.labels(0);
  Span moved, asked_beside, asked_back;
  int run = 0;  // rows one after the other that moved
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
    asked[r + next] |= from_z;
    if ((what & at_end) != 0 && rows_[r + beside].filled) {
      asked[r + beside] |= from_x;
      asked_beside.add(at);
    }
    if ((what & (kAsksY | kAsksX | kAsksZ)) == 0) continue;
    if ((what & kAsksY) != 0) {
      asked[r - row_y] |= step > 0 ? kFromAboveY : kFromBelowY;
      (step > 0 ? sweep.down : sweep.up).add(at - step);
    }
    if ((what & kAsksX) != 0 && rows_[r - beside].filled) {
      asked[r - beside] |= back_x;
      asked_back.add(at);
    }
    if ((what & kAsksZ) != 0) {
      asked[r - next] |= back_z;
      sweep.back.add(at);
    }
  }
  note_run(count);
  sweep.next.add(moved);
  const auto ask_column = [&](int x, const Span& span) {
    if (span.empty()) return;
    const int column = plane.column + x;
    in_plane_[static_cast<std::size_t>(column)][x > 0 ? 0 : 1].add(span);
    sweep.columns.add(column);
  };
  ask_column(plane.x, asked_beside);
  ask_column(-plane.x, asked_back);
}

// Beside anchors, or with one in it, a row is dealt with by itself, and what is asked of anchors by the
// queue. True where it moved.
bool ChainWave::pull_by_anchor(const Pass& p, Sweep& sweep, Pull task, RowId row, int y) noexcept {
  const auto number = [this](const RowInfo* info) { return static_cast<RowId>(info - rows_.data()); };
  const std::array<RowId, 3> from{number(task.own.info - task.step),
                                  task.z.u != nullptr ? number(task.z.info) : 0, number(task.x.info)};
  asked_[row] &= static_cast<std::uint8_t>(~task.by);
  if (rows_[row].anchored) {
    for (const RowId r : from) {
      if (moved_.has(r)) enqueue(r);
    }
    return false;
  }
  task.y = !rows_[from[0]].anchored;
  if (rows_[from[1]].anchored) task.z = {};
  if (rows_[from[2]].anchored) task.x = {};
  task.by = 0xFF;
  task.count = task.most = 1;
  std::uint8_t asked = 1;
  task.asked = &asked;
  (p.way == Way::raise ? raise_pulled : lower_pulled)(task, 1, moves_.data());
  if (moves_.front() == kNothingMoved) return false;
  note_pulled(sweep, row, y, 1);
  enqueue(row);
  return true;
}

// Rows of `span` that are asked, and those after a row that moved, upwards or downwards in y.
void ChainWave::pull_rows(const Pass& p, Sweep& sweep, int step, const Span& span) noexcept {
  if (span.empty()) return;
  const Grid& grid = lattice_.grid();
  Plane& plane = sweep.plane;
  plane.step = step;
  Pull task = sweep.task;
  task.step = step;
  const auto half = [&p](int n) { return p.limits.half[static_cast<std::size_t>(n)]; };
  task.along_y = step > 0 ? PullHalves{half(2), half(3)} : PullHalves{half(3), half(2)};
  task.by = static_cast<std::uint8_t>((step > 0 ? kFromBelowY : kFromAboveY) |
                                      (plane.x > 0 ? kFromBelowX : kFromAboveX) |
                                      (plane.z > 0 ? kFromBelowZ : kFromAboveZ));
  int y = step > 0 ? span.low : span.high;
  bool on = false;
  task.count = span.high - span.low + 1;
  task.most = step > 0 ? grid.dims[1] - y : y + 1;
  while (task.most > 0 && (on || task.count > 0)) {
    const RowId row = grid.row(plane.column, y, plane.at);
    const auto strip = [&](RowId r) { return RowStrip{row_at(p, r), lattice_.labels(r), &info(r)}; };
    task.own = strip(row);
    const int from_z = plane.at - plane.z;
    task.z = from_z >= 0 && from_z < grid.dims[2] ? strip(row - static_cast<RowId>(plane.z) * grid.row_z)
                                                  : RowStrip{};
    task.x = strip(row - static_cast<RowId>(plane.x) * grid.row_x);
    task.asked = &asked_[row];
    const bool by_anchor = task.own.info->anchored || (task.z.u != nullptr && task.z.info->anchored) ||
                           task.x.info->anchored || (task.own.info - step)->anchored;
    Pulled done{1, 1};
    if (by_anchor && (on || (asked_[row] & task.by) != 0)) {
      on = pull_by_anchor(p, sweep, task, row, y);
    } else {
      // A row that comes after one that moved is asked, too.
      if (on) asked_[row] |= task.by;
      const std::uint64_t left = sweep.most - std::min(sweep.most, sweep.visits);
      const int most = static_cast<int>(std::min<std::uint64_t>(left, 1U << 30U));
      done = (p.way == Way::raise ? raise_pulled : lower_pulled)(task, most, moves_.data());
      note_pulled(sweep, row, y, done.end);
      on = done.end > 0 && moves_[static_cast<std::size_t>(done.end - 1)] != kNothingMoved;
      if (done.visits >= most) sweep.stopped = true;
    }
    sweep.visits += static_cast<std::uint64_t>(done.visits);
    task.count -= done.end;
    task.most -= done.end;
    y += done.end * step;
    if (sweep.stopped) {
      if (on && task.most > 0) asked_[grid.row(plane.column, y, plane.at)] |= task.by;
      sweep.rest.add({std::min(span.low, y), std::max(span.high, y)});
      return;
    }
  }
}

// The rows of one column in a plane: from where the sources stand up and down in y, and again where one is
// asked by the next, until none is.
void ChainWave::sweep_rows(const Pass& p, Sweep& sweep, int column, int x, const Span& span) noexcept {
  Plane& plane = sweep.plane;
  plane.column = column;
  plane.x = x;
  const auto half = [&p](int n) { return p.limits.half[static_cast<std::size_t>(n)]; };
  sweep.task.along_x = x > 0 ? PullHalves{half(0), half(1)} : PullHalves{half(1), half(0)};
  sweep.task.x_above = x < 0;
  sweep.next = sweep.back = {};
  // Beside the sources, rows may be asked by any neighbour; elsewhere only by the plane or column before.
  const bool at_sources = plane.at >= sweep.sources.low - 1 && plane.at <= sweep.sources.high + 1;
  sweep.up = {};
  sweep.down = {span.low, at_sources ? span.high : std::min(sweep.y - 1, span.high)};
  if (at_sources) sweep.up = span;
  pull_rows(p, sweep, 1, {std::max(sweep.y, span.low), span.high});
  while (!sweep.stopped && !(sweep.up.empty() && sweep.down.empty())) {
    pull_rows(p, sweep, -1, std::exchange(sweep.down, {}));
    if (sweep.stopped) break;
    pull_rows(p, sweep, 1, std::exchange(sweep.up, {}));
  }
  if (sweep.stopped) {
    sweep.rest.add(sweep.up);
    sweep.rest.add(sweep.down);
    sweep.rest.add(span);
    asked_span(plane.z > 0 ? 0 : 1, column, plane.at).add(sweep.rest);
    sweep.planes[plane.z > 0 ? 0 : 1].add(plane.at);
  }
  const auto hand_on = [&](int z, int way, const Span& rows) {
    if (rows.empty() || z < 0 || z >= lattice_.grid().dims[2]) return;
    asked_span(way, column, z).add(rows);
    sweep.planes[static_cast<std::size_t>(way)].add(z);
  };
  hand_on(plane.at + plane.z, plane.z > 0 ? 0 : 1, sweep.next);
  hand_on(plane.at - plane.z, plane.z > 0 ? 1 : 0, sweep.back);
}

// The columns of one plane, likewise.
void ChainWave::sweep_plane(const Pass& p, Sweep& sweep, int z, int by) noexcept {
  const int way = by > 0 ? 0 : 1;
  sweep.plane.at = z;
  sweep.plane.z = by;
  const auto half = [&p](int n) { return p.limits.half[static_cast<std::size_t>(n)]; };
  sweep.task.along_z = by > 0 ? PullHalves{half(4), half(5)} : PullHalves{half(5), half(4)};
  int begin = std::clamp(sweep.column, sweep.columns.low, sweep.columns.high);
  const bool at_sources = z >= sweep.sources.low - 1 && z <= sweep.sources.high + 1;
  for (int c = sweep.columns.low; c <= sweep.columns.high; ++c) {
    const Span span = std::exchange(asked_span(way, c, z), {});
    in_plane_[static_cast<std::size_t>(c)] = {at_sources || c >= begin ? span : Span{},
                                              at_sources || c < begin ? span : Span{}};
  }
  const auto swept = [&](int column, int x) {
    const Span span = std::exchange(in_plane_[static_cast<std::size_t>(column)][x > 0 ? 0 : 1], {});
    if (span.empty()) return false;
    sweep_rows(p, sweep, column, x, span);
    return true;
  };
  for (bool any = true; any && !sweep.stopped; begin = sweep.columns.low) {
    any = false;
    for (int c = begin; c <= sweep.columns.high && !sweep.stopped; ++c) any = swept(c, 1) || any;
    for (int c = sweep.columns.high; c >= sweep.columns.low && !sweep.stopped; --c) any = swept(c, -1) || any;
  }
  for (int c = sweep.columns.low; sweep.stopped && c <= sweep.columns.high; ++c) {
    for (Span& span : in_plane_[static_cast<std::size_t>(c)])
      asked_span(way, c, z).add(std::exchange(span, {}));
  }
  if (sweep.stopped) sweep.planes[static_cast<std::size_t>(way)].add(z);
}

// Of a sweep that was stopped: the rows wait that are still to ask.
void ChainWave::leave_sweep(const Pass& p, Sweep& sweep) noexcept {
  const Grid& grid = lattice_.grid();
  const std::array<RowId, 6> from{1, ~RowId{0}, grid.row_x, ~grid.row_x + 1, grid.row_z, ~grid.row_z + 1};
  for (int way = 0; way < 2; ++way) {
    const Span planes = sweep.planes[static_cast<std::size_t>(way)];
    for (int z = planes.low; z <= planes.high; ++z) {
      for (int c = sweep.columns.low; c <= sweep.columns.high; ++c) {
        const Span span = std::exchange(asked_span(way, c, z), {});
        for (int y = std::max(span.low, 0); y <= std::min(span.high, grid.dims[1] - 1); ++y) {
          const RowId row = grid.row(c, y, z);
          for (std::size_t n = 0; n < from.size(); ++n) {
            if ((asked_[row] >> n & 1U) != 0 && info(row - from[n]).filled)
              wait(row - from[n], wave_bit(p.axis, p.way));
          }
          asked_[row] = 0;
        }
      }
    }
  }
}

// Moves what hangs on the sources, which stand where they are to go. False where the queue is to do it.
bool ChainWave::sweep(const Pass& p, std::span<const Source> sources, std::uint64_t most,
                      std::uint64_t& visits) noexcept {
  Sweep sweep;
  if (most < kLeastSwept || !begin_sweep(p, sources, sweep)) return false;
  sweep.most = most - kLeastSwept / 2;
  sweep.task.margin = p.margin;
  sweep.plane.u = p.u;
  sweep.task.registers = limits_.registers();
  sweep.task.up = p.limits.half[0];
  sweep.task.down = p.limits.half[1];
  while (!sweep.stopped && !(sweep.planes[0].empty() && sweep.planes[1].empty())) {
    for (const int by : {-1, 1}) {
      const std::size_t way = by > 0 ? 0 : 1;
      Span& planes = sweep.planes[way];
      for (int z = by > 0 ? planes.low : planes.high; !sweep.stopped && z >= planes.low && z <= planes.high;
           z += by)
        sweep_plane(p, sweep, z, by);
      if (!sweep.stopped) planes = {};
    }
  }
  visits += sweep.visits;
  work_ += sweep.visits;
  if (sweep.stopped) {
    leave_sweep(p, sweep);
    // What is around the sources is settled in any case.
    for (const Source& s : sources) enqueue(s.v / kRow);
    visits += run(p, kLeastSwept / 2);
  }
  return true;
}

}  // namespace voxel
