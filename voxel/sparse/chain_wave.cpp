// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/sparse/chain_wave.h"

#include <algorithm>
#include <utility>

namespace voxel::sparse {
namespace {

constexpr std::uint32_t kAll = 0xFFFFFFFFU;
constexpr std::size_t kAhead = 12;  // rows
constexpr std::size_t kMostCones = 4;
constexpr std::uint64_t kConeRows = 8;  // of a cone take as long as one update of a row

}  // namespace

ChainWave::ChainWave(const Lattice& lattice)
    : lattice_(lattice),
      limits_(lattice),
      rows_(lattice.grid().rows()),
      ring_(lattice.grid().rows() + 1),
      moved_(lattice.grid().rows() + 1),
      pulled_(lattice.grid().rows()),
      waiting_(lattice.grid().rows()),
      taken_(lattice.grid().rows()),
      fall_(static_cast<std::size_t>(lattice.grid().columns) * kRow) {
  const Grid& grid = lattice.grid();
  free_low_ = grid.dims;
  free_high_.fill(-1);
  std::size_t count = 0;
  for (RowId row = 0; row < grid.rows(); ++row) {
    if (lattice.filled_in(row) == 0) continue;
    const std::uint8_t* const labels = lattice.labels(row);
    std::uint32_t free = 0, anchors = 0;
    bool alike = true;
    for (VoxelId i = 0; i < kRow; ++i) {
      const std::uint32_t bit = 1U << i;
      alike = alike && labels[i] == labels[0];
      if (labels[i] == 0) continue;
      (lattice.anchored(row * kRow + i) ? anchors : free) |= bit;
    }
    const bool plain = free == kAll && alike;
    rows_[row] = {free, plain ? labels[0] : std::uint8_t{0}, true, anchors != 0, 0, 0};
    if (free == 0) continue;
    count += static_cast<std::size_t>(__builtin_popcount(free));
    const std::array<int, 3> c = grid.row_coordinates(row);
    const int x = (c[0] - 1) * kRow;
    free_low_[0] = std::min(free_low_[0], x + __builtin_ctz(free));
    free_high_[0] = std::max(free_high_[0], x + kRow - 1 - __builtin_clz(free));
    for (std::size_t d = 1; d < 3; ++d) {
      free_low_[d] = std::min(free_low_[d], c[d]);
      free_high_[d] = std::max(free_high_[d], c[d]);
    }
  }
  std::size_t box = 1;
  for (std::size_t d = 0; d < 3; ++d)
    box *= static_cast<std::size_t>(std::max(0, free_high_[d] - free_low_[d] + 1));
  free_is_box_ = box == count;
}

void ChainWave::begin() noexcept {
  for (std::size_t n = 0; n < moved_count_; ++n) rows_[moved_[n]].mark = 0;
  for (std::size_t n = 0; n < pulled_count_; ++n) rows_[pulled_[n]].mark = 0;
  moved_count_ = pulled_count_ = 0;
  work_ = 0;
}

inline void ChainWave::enqueue(RowId row, std::uint8_t ends) noexcept {
  std::uint8_t& mark = rows_[row].mark;
  const bool waited = (mark & queued) != 0;
  mark |= static_cast<std::uint8_t>(ends | queued);
  if (waited) return;
  ring_[tail_] = row;
  tail_ = tail_ + 1 == ring_.size() ? 0 : tail_ + 1;
}

void ChainWave::note_moved(RowId row) noexcept {
  std::uint8_t& mark = rows_[row].mark;
  moved_[moved_count_] = row;  // one beyond, where it is there already
  moved_count_ += (mark & moved) == 0 ? 1 : 0;
  mark |= moved;
}

void ChainWave::note_pulled(RowId row) noexcept {
  std::uint8_t& mark = rows_[row].mark;
  if ((mark & pulled) != 0) return;
  mark |= pulled;
  pulled_[pulled_count_++] = row;
}

// ---- rows in a queue ----

// The voxel beyond the end of a row.
void ChainWave::ask_across(const Pass& p, RowId row, RowId to, int direction) noexcept {
  const RowInfo &own = rows_[row], &other = rows_[to];
  if (!other.filled) return;
  const VoxelId end = kRow - 1, from = row * kRow + (direction == 0 ? end : 0),
                at = to * kRow + (direction == 0 ? 0 : end);
  if (own.label == 0 || other.label == 0) {
    if (lattice_.filled(from)) ask_voxel(p, from, at, direction);
    return;
  }
  const float limit = p.limits.between(direction, own.label, other.label);
  const float wanted = p.way == Way::raise ? p.u[from] - limit : p.u[from] + limit;
  if (p.way == Way::raise ? !(wanted > p.u[at] + p.margin) : !(wanted < p.u[at] - p.margin)) return;
  p.u[at] = wanted;
  note_moved(to);
  enqueue(to, direction == 0 ? first : last);
}

void ChainWave::ask_voxel(const Pass& p, VoxelId from, VoxelId to, int direction) noexcept {
  const RowId row = to / kRow;
  if (!lattice_.filled(to)) return;
  const float limit = p.limits.between(direction, lattice_.label(from), lattice_.label(to));
  const float wanted = p.way == Way::raise ? p.u[from] - limit : p.u[from] + limit;
  if (p.way == Way::raise ? !(wanted > p.u[to] + p.margin) : !(wanted < p.u[to] - p.margin)) return;
  if (!free(to)) {
    note_pulled(row);
    return;
  }
  p.u[to] = wanted;
  note_moved(row);
  enqueue(row);
}

void ChainWave::ask_beside(const Pass& p, RowId row, RowId to, int direction) noexcept {
  if (!rows_[to].filled) return;
  if (rows_[to].anchored) {
    for (VoxelId i = 0; i < kRow; ++i) {
      if (lattice_.filled(row * kRow + i)) ask_voxel(p, row * kRow + i, to * kRow + i, direction);
    }
    return;
  }
  float* const own = row_at(p, row);
  float* const other = row_at(p, to);
  const float* const half = p.limits.half[static_cast<std::size_t>(direction)];
  const std::uint8_t a = rows_[row].label, b = rows_[to].label;
  Moved moves = kNothingMoved;
  if (a != 0 && b != 0) {
    moves = p.way == Way::raise ? raise_beside_alike(own, other, half[a] + half[b], p.margin)
                                : lower_beside_alike(own, other, half[a] + half[b], p.margin);
  } else {
    const HalfLimits h{half, limits_.registers()};
    const std::uint8_t *la = lattice_.labels(row), *lb = lattice_.labels(to);
    moves = p.way == Way::raise ? raise_beside(own, la, other, lb, h, p.margin)
                                : lower_beside(own, la, other, lb, h, p.margin);
  }
  if (moves == kNothingMoved) return;
  note_moved(to);
  enqueue(to, moves & (first | last));
}

Moved ChainWave::ask_along(const Pass& p, RowId row) noexcept {
  float* const own = row_at(p, row);
  if (rows_[row].anchored) {
    const VoxelId begin = row * kRow, end = begin + kRow - 1;
    for (VoxelId v = begin; v < end; ++v) {
      if (lattice_.filled(v)) ask_voxel(p, v, v + 1, 0);
    }
    for (VoxelId v = end; v > begin; --v) {
      if (lattice_.filled(v)) ask_voxel(p, v, v - 1, 1);
    }
    return kFirstMoved | kLastMoved;
  }
  const std::uint8_t label = rows_[row].label;
  if (label != 0) {
    const float up = p.limits.between(0, label, label), down = p.limits.between(1, label, label);
    return p.way == Way::raise ? raise_along_alike(own, up, down, p.margin)
                               : lower_along_alike(own, up, down, p.margin);
  }
  const HalfLimits up{p.limits.half[0], limits_.registers()}, down{p.limits.half[1], limits_.registers()};
  return p.way == Way::raise ? raise_along(own, lattice_.labels(row), up, down, p.margin)
                             : lower_along(own, lattice_.labels(row), up, down, p.margin);
}

void ChainWave::ask_around(const Pass& p, RowId row) noexcept {
  const Grid& grid = lattice_.grid();
  // Before it asks: with anchors in it, a row may put itself into the queue again.
  std::uint8_t ends = rows_[row].mark & (first | last);
  rows_[row].mark &= static_cast<std::uint8_t>(~(queued | first | last));
  ends |= ask_along(p, row);
  ask_beside(p, row, row + 1, 2);
  ask_beside(p, row, row - 1, 3);
  ask_beside(p, row, row + grid.row_z, 4);
  ask_beside(p, row, row - grid.row_z, 5);
  if ((ends & last) != 0) ask_across(p, row, row + grid.row_x, 0);
  if ((ends & first) != 0) ask_across(p, row, row - grid.row_x, 1);
}

// A row's neighbours lie in as many places; what stands further back in the queue is fetched meanwhile.
inline void ChainWave::fetch_around(const Pass& p, RowId row) const noexcept {
  const Grid& grid = lattice_.grid();
  const RowInfo info = rows_[row];
  const auto fetch = [&](RowId r) {
    __builtin_prefetch(row_at(p, r));
    __builtin_prefetch(row_at(p, r) + kCone);
  };
  __builtin_prefetch(&rows_[row - grid.row_z]);
  __builtin_prefetch(&rows_[row + grid.row_z]);
  fetch(row - grid.row_z);
  fetch(row + grid.row_z);
  fetch(row - 1);
  fetch(row + 1);
  if (info.label == 0) {
    __builtin_prefetch(lattice_.labels(row - grid.row_z));
    __builtin_prefetch(lattice_.labels(row + grid.row_z));
  }
  if ((info.mark & last) != 0) {
    __builtin_prefetch(row_at(p, row + grid.row_x));
    __builtin_prefetch(&rows_[row + grid.row_x]);
    __builtin_prefetch(lattice_.labels(row + grid.row_x));
  }
  if ((info.mark & first) != 0) {
    __builtin_prefetch(row_at(p, row - grid.row_x) + kCone);
    __builtin_prefetch(&rows_[row - grid.row_x]);
    __builtin_prefetch(lattice_.labels(row - grid.row_x));
  }
}

std::uint64_t ChainWave::run(const Pass& p, std::uint64_t most) noexcept {
  std::uint64_t visits = 0;
  for (; head_ != tail_ && visits < most; ++visits) {
    const RowId row = ring_[head_];
    const std::size_t ahead = head_ + kAhead < ring_.size() ? head_ + kAhead : 0;
    fetch_around(p, ring_[ahead]);  // past the queue's end, whatever was there before
    head_ = head_ + 1 == ring_.size() ? 0 : head_ + 1;
    ask_around(p, row);
  }
  for (; head_ != tail_; head_ = head_ + 1 == ring_.size() ? 0 : head_ + 1) {
    rows_[ring_[head_]].mark &= static_cast<std::uint8_t>(~(queued | first | last));
    wait(ring_[head_], wave_bit(p.axis, p.way));
  }
  work_ += visits;
  return visits;
}

void ChainWave::wait(RowId row, std::uint8_t waves) noexcept {
  std::uint8_t& waits = rows_[row].waits;
  if ((waits & kListed) == 0) waiting_[waiting_count_++] = row;
  waits |= static_cast<std::uint8_t>(waves | kListed);
}

std::uint64_t ChainWave::spread(float* u, int axis, Way way, std::span<Source> sources, float margin,
                                std::uint64_t most) noexcept {
  if (sources.empty()) return 0;
  Pass p{u, axis, way, margin, limits_.pass(axis, way), {}};
  // The one that goes furthest first: what it takes along needs no second visit.
  std::sort(sources.begin(), sources.end(), [way](const Source& a, const Source& b) {
    if (a.u != b.u) return way == Way::raise ? a.u > b.u : a.u < b.u;
    return a.v < b.v;
  });
  const bool cones = lattice_.uniform_limits() && sources.size() <= kMostCones;
  const std::uint8_t label = lattice_.label(sources.front().v);
  for (int n = 0; n < kWays; ++n)
    p.limit[static_cast<std::size_t>(n)] = static_cast<double>(p.limits.between(n, label, label));
  cone_rows_ = 0;
  std::uint64_t visits = 0;
  const auto taken = [&] { return visits + cone_rows_ / kConeRows; };
  const auto left = [&] { return taken() < most ? most - taken() : 0; };
  for (const Source& s : sources) {
    note_moved(s.v / kRow);
    if (way == Way::raise ? s.u <= u[s.v] : s.u >= u[s.v]) continue;  // a stronger one took it along
    u[s.v] = s.u;
    // A cone is cut out of a state that violates nothing: one after the other, and none while rows wait.
    if (!cones || waiting_count_ > 0 || !cone(p, s.v, left())) enqueue(s.v / kRow);
    if (cones) visits += run(p, left());
  }
  visits += run(p, left());
  work_ += cone_rows_ / kConeRows;
  return taken();
}

std::uint64_t ChainWave::spread_from_pulled(float* u, int axis, Way way, float margin,
                                            std::uint64_t most) noexcept {
  const Pass p{u, axis, way, margin, limits_.pass(axis, way), {}};
  const std::size_t count = pulled_count_;
  for (std::size_t n = 0; n < count; ++n) enqueue(pulled_[n]);
  return run(p, most);
}

void ChainWave::take_waiting() noexcept {
  std::swap(waiting_, taken_);
  taken_count_ = std::exchange(waiting_count_, 0);
  for (std::size_t n = 0; n < taken_count_; ++n)
    rows_[taken_[n]].waits &= static_cast<std::uint8_t>(~kListed);
}

std::uint64_t ChainWave::spread_from_taken(float* u, int axis, Way way, float margin,
                                           std::uint64_t most) noexcept {
  const Pass p{u, axis, way, margin, limits_.pass(axis, way), {}};
  const std::uint8_t bit = wave_bit(axis, way);
  std::uint64_t count = 0;
  for (std::size_t n = 0; n < taken_count_ && count < most; ++n) {
    std::uint8_t& waits = rows_[taken_[n]].waits;
    if ((waits & bit) == 0) continue;
    waits &= static_cast<std::uint8_t>(~bit);
    enqueue(taken_[n]);
    ++count;
  }
  return run(p, most);
}

void ChainWave::put_back() noexcept {
  for (std::size_t n = 0; n < taken_count_; ++n) {
    if (rows_[taken_[n]].waits != 0) wait(taken_[n], 0);
  }
  taken_count_ = 0;
}

// ---- cones in closed form ----

// How far a cone gets along the three lines through its apex. Where nothing but free voxels is within, those
// at which it ends included, it raises nothing beyond: what it raises there, it raises all along every
// shortest way to it, and one of these leads over such a line.
ChainWave::Box ChainWave::reach(const Pass& p, VoxelId apex) const noexcept {
  Box box;
  const Grid& grid = lattice_.grid();
  for (int n = 0; n < kWays; ++n) {
    const auto un = static_cast<std::size_t>(n);
    const double limit = p.limit[un];
    VoxelId v = apex;
    for (int k = 1;; ++k) {
      v = n % 2 == 0 ? grid.up(v, n / 2) : grid.down(v, n / 2);
      box.cut[un] = !free(v);
      if (box.cut[un]) break;
      const double by =
          (static_cast<double>(p.u[apex]) - static_cast<double>(p.u[v])) * (p.way == Way::raise ? 1.0 : -1.0);
      if (by - k * limit <= static_cast<double>(p.margin)) break;
      ++box.steps[un];
    }
  }
  return box;
}

bool ChainWave::full(const std::array<int, 3>& low, const std::array<int, 3>& high) const noexcept {
  if (free_is_box_) return true;
  const Grid& grid = lattice_.grid();
  for (int c = low[0] / kRow + 1; c <= high[0] / kRow + 1; ++c) {
    const int x = (c - 1) * kRow;
    std::uint32_t needed = kAll;
    if (low[0] > x) needed &= kAll << (low[0] - x);
    if (high[0] < x + kRow - 1) needed &= kAll >> (x + kRow - 1 - high[0]);
    for (int z = low[2]; z <= high[2]; ++z) {
      const RowInfo* const row = rows_.data() + grid.row(c, low[1], z);
      std::uint32_t all = kAll;
      for (int n = 0; n <= high[1] - low[1]; ++n) all &= row[n].free;
      if ((all & needed) != needed) return false;
    }
  }
  return true;
}

bool ChainWave::cone(const Pass& p, VoxelId apex, std::uint64_t most) noexcept {
  if (lattice_.anchored(apex)) return false;
  const Box box = reach(p, apex);
  const std::array<int, 3> at = lattice_.coordinates(apex);
  std::array<int, 3> low{}, high{};
  for (std::size_t d = 0; d < 3; ++d) {
    // With the first voxels that it does not raise: only if there is no gap among these does it end there.
    low[d] = at[d] - box.steps[2 * d + 1] - (box.cut[2 * d + 1] ? 0 : 1);
    high[d] = at[d] + box.steps[2 * d] + (box.cut[2 * d] ? 0 : 1);
  }
  // An octahedron in this box takes no more than half of its rows.
  const auto size = [&](std::size_t d) { return static_cast<std::uint64_t>(high[d] - low[d] + 1); };
  if ((size(0) / kRow + 2) * size(1) * size(2) / 2 / kConeRows > most || !full(low, high)) return false;
  write_cone(p, apex, box);
  enqueue_cut_faces(apex, box);
  return true;
}

// Rows of one column and one z, from `row` up and down in y; lane `nearest` is that nearest to the apex.
// Returns how many were raised; the apex's own counts as raised.
int ChainWave::write_column(const Pass& p, RowId row, int nearest, bool has_apex, const Box& box, double base,
                            const float* fall) noexcept {
  const auto write = p.way == Way::raise ? raise_cone : lower_cone;
  const double above = p.limit[2], below = p.limit[3], sign = p.way == Way::raise ? -1.0 : 1.0;
  const int up = box.steps[2], down = box.steps[3];
  const std::ptrdiff_t next = static_cast<std::ptrdiff_t>(lattice_.grid().row_z) * kRow;
  // Where the nearest lane is not raised none is, and beyond no row; so for each half of the row.
  int n = 0, m = 0;
  const int half = nearest / kCone * kCone;
  for (const int lanes : {half, kCone - half}) {
    const int near = lanes == half ? nearest - half : lanes > half ? 0 : kCone - 1;
    float* const at = row_at(p, row) + lanes;
    const float* const f = fall + lanes;
    const bool apex = has_apex && lanes == half;
    int raised = 0;
    if (apex) {
      raised = write({at, kRow, 1, next}, base, 0.0, f, near, -ChainLimits::kNoLink);
      raised += write({at + kRow, kRow, up, next}, base + sign * above, above, f, near, p.margin);
    } else {
      raised = write({at, kRow, up + 1, next}, base, above, f, near, p.margin);
      if (raised == 0) break;
    }
    const int back = write({at - kRow, -kRow, down, next}, base + sign * below, below, f, near, p.margin);
    n = std::max(n, raised);
    m = std::max(m, back);
  }
  for (RowId r = row - static_cast<RowId>(m); r < row + static_cast<RowId>(n); ++r) note_moved(r);
  cone_rows_ += static_cast<std::uint64_t>(n + m);
  return n + m;
}

void ChainWave::write_cone(const Pass& p, VoxelId apex, const Box& box) noexcept {
  const Grid& grid = lattice_.grid();
  const std::array<int, 3> at = lattice_.coordinates(apex);
  const int low_x = at[0] - box.steps[1], high_x = at[0] + box.steps[0];
  const int column = at[0] / kRow + 1, low_column = low_x / kRow + 1, high_column = high_x / kRow + 1;
  for (int c = low_column; c <= high_column; ++c) {
    for (int i = 0; i < kRow; ++i) {
      const int x = (c - 1) * kRow + i;
      const double steps = x < at[0] ? at[0] - x : x - at[0];
      fall_[static_cast<std::size_t>(c * kRow + i)] =
          x < low_x || x > high_x ? ChainLimits::kNoLink
                                  : static_cast<float>(steps * p.limit[x < at[0] ? 1 : 0]);
    }
  }
  const double sign = p.way == Way::raise ? -1.0 : 1.0, top = static_cast<double>(p.u[apex]);
  for (int k = -box.steps[5]; k <= box.steps[4]; ++k) {
    const double base = top + sign * (k < 0 ? -k * p.limit[5] : k * p.limit[4]);
    const auto line = [&](int c) {
      const int nearest = c == column ? at[0] % kRow : c > column ? 0 : kRow - 1;
      return write_column(p, grid.row(c, at[1], at[2] + k), nearest, k == 0 && c == column, box, base,
                          fall_.data() + static_cast<std::size_t>(c) * kRow);
    };
    for (int c = column; c <= high_column && line(c) > 0; ++c) {
    }
    for (int c = column - 1; c >= low_column && line(c) > 0; --c) {
    }
  }
}

// Where the box ends at something that is no free voxel, the wave may go on beside it, or pull an anchor.
void ChainWave::enqueue_cut_faces(VoxelId apex, const Box& box) noexcept {
  const Grid& grid = lattice_.grid();
  const std::array<int, 3> at = lattice_.coordinates(apex);
  for (int n = 0; n < kWays; ++n) {
    const auto un = static_cast<std::size_t>(n), d = un / 2;
    if (!box.cut[un]) continue;
    std::array<int, 3> low{}, high{};
    for (std::size_t e = 0; e < 3; ++e) {
      low[e] = at[e] - box.steps[2 * e + 1];
      high[e] = at[e] + box.steps[2 * e];
    }
    (n % 2 == 0 ? low : high)[d] = (n % 2 == 0 ? high : low)[d];
    const int beyond = n % 2 == 0 ? 1 : -1;
    for (int c = low[0] / kRow + 1; c <= high[0] / kRow + 1; ++c) {
      for (int z = low[2]; z <= high[2]; ++z) {
        for (int y = low[1]; y <= high[1]; ++y) {
          std::array<int, 3> other{0, y, z};
          if (d > 0) other[d] += beyond;
          const bool something = d == 0 ? lattice_.filled(grid.at(low[0] + beyond, y, z))
                                        : rows_[grid.row(c, other[1], other[2])].filled;
          if (something) enqueue(grid.row(c, y, z));
        }
      }
    }
  }
}

std::size_t ChainWave::memory_bytes() const {
  return rows_.resident_bytes() + ring_.resident_bytes() + moved_.resident_bytes() +
         pulled_.resident_bytes() + waiting_.resident_bytes() + taken_.resident_bytes() +
         fall_.size() * sizeof(float);
}

}  // namespace voxel::sparse
