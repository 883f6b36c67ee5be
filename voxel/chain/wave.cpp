// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/chain/wave.h"

#include <algorithm>
#include <utility>

namespace voxel {
namespace {

constexpr std::size_t kPrefetchRows = 12;  // rows ahead
constexpr std::size_t kMaxCones = 4;       // up to this many sources get a cone each; more get one sweep

}  // namespace

ChainWave::ChainWave(const Lattice& lattice)
    : lattice_(lattice),
      limits_(lattice),
      rows_(lattice.grid().rows()),
      ring_(lattice.grid().rows() + 1),
      moved_(lattice.grid().rows()),
      pulled_(lattice.grid().rows()),
      waiting_(lattice.grid().rows()),
      taken_(lattice.grid().rows()),
      pulled_by_(lattice.grid().rows()),
      pending_(lattice.grid().rows()),
      pending_ranges_(2 * static_cast<std::size_t>(lattice.grid().columns) *
                      (static_cast<std::size_t>(lattice.grid().dims[2]) + 2)),
      pending_in_plane_(static_cast<std::size_t>(lattice.grid().columns)),
      moves_(static_cast<std::size_t>(lattice.grid().dims[1])),
      fall_(static_cast<std::size_t>(lattice.grid().columns) * kRow) {
  const Grid& grid = lattice.grid();
  free_low_ = grid.dims;
  free_high_.fill(-1);
  for (RowId row = 0; row < grid.rows(); ++row) {
    const std::uint32_t free = lattice.filled_lanes(row) & ~lattice.anchored_lanes(row);
    if (free == 0) continue;
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
  free_is_box_ = box == lattice.voxel_count() - lattice.anchored_count();
}

void ChainWave::look_up(RowId row) noexcept {
  const RowId row_z = lattice_.grid().row_z, begin = row / row_z * row_z;
  for (RowId r = begin; r < begin + row_z; ++r) {
    RowInfo& out = rows_[r];
    const std::uint32_t filled = lattice_.filled_lanes(r), anchors = lattice_.anchored_lanes(r);
    const std::uint8_t* const labels = lattice_.labels(r);
    out.free = filled & ~anchors;
    out.filled = filled != 0;
    out.anchored = anchors != 0;
    out.known = true;
    if (out.free != kFullRow) continue;
    if (lattice_.inside(r) != 0 || std::count(labels, labels + kRow, labels[0]) == kRow)
      out.label = labels[0];
  }
}

void ChainWave::prepare_all() noexcept {
  const Grid& grid = lattice_.grid();
  for (RowId row = 0; row < grid.rows(); row += grid.row_z) look_up(row);
}

void ChainWave::begin() noexcept {
  moved_.clear();
  for (std::size_t n = 0; n < pulled_count_; ++n) pulled_by_[pulled_[n]] = 0;
  pulled_count_ = 0;
  work_ = 0;
}

// A pulled anchor stays. So voxels that a raising wave raised too far for the anchor must be lowered again,
// and the reverse.
void ChainWave::note_pulled(const WaveArgs& p, RowId row) noexcept {
  std::uint8_t& by = pulled_by_[row];
  if (by == 0) pulled_[pulled_count_++] = row;
  by |= wave_bit(p.axis, p.way == Way::raise ? Way::lower : Way::raise);
}

// Relaxes the link across the end of a row, to the first voxel of the next row along x.
void ChainWave::relax_across(const WaveArgs& p, RowId row, RowId to, int direction) noexcept {
  const RowInfo &own = info(row), &other = info(to);
  if (!other.filled) return;
  const VoxelId end = kRow - 1, from = row * kRow + (direction == 0 ? end : 0),
                at = to * kRow + (direction == 0 ? 0 : end);
  if (own.label == 0 || other.label == 0) {
    if (lattice_.filled(from)) relax_link(p, from, at, direction);
    return;
  }
  const float limit = p.limits.between(direction, own.label, other.label);
  const float required = p.way == Way::raise ? p.u[from] - limit : p.u[from] + limit;
  if (p.way == Way::raise ? !(required > p.u[at] + p.margin) : !(required < p.u[at] - p.margin)) return;
  p.u[at] = required;
  note_moved(to);
  enqueue(to, direction == 0 ? first : last);
}

void ChainWave::relax_link(const WaveArgs& p, VoxelId from, VoxelId to, int direction) noexcept {
  const RowId row = to / kRow;
  if (!lattice_.filled(to)) return;
  const float limit = p.limits.between(direction, lattice_.label(from), lattice_.label(to));
  const float required = p.way == Way::raise ? p.u[from] - limit : p.u[from] + limit;
  if (p.way == Way::raise ? !(required > p.u[to] + p.margin) : !(required < p.u[to] - p.margin)) return;
  if (!free(to)) {
    note_pulled(p, row);
    return;
  }
  p.u[to] = required;
  note_moved(row);
  enqueue(row);
}

void ChainWave::relax_beside(const WaveArgs& p, RowId row, RowId to, int direction) noexcept {
  const RowInfo& other_row = info(to);
  if (!other_row.filled) return;
  float* const own = row_at(p, row);
  float* other = row_at(p, to);
  std::array<float, kRow> required;
  if (other_row.anchored) {
    std::copy_n(other, kRow, required.data());
    other = required.data();
  }
  const float* const half = p.limits.half[static_cast<std::size_t>(direction)];
  const std::uint8_t a = info(row).label, b = other_row.label;
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
  if (other_row.anchored) moves = move_free(p, to, required.data());
  if (moves == kNothingMoved) return;
  note_moved(to);
  enqueue(to, moves & (first | last));
}

// Moves the free voxels of a row with anchors to `required`. Anchors that would have to move are pulled.
Moved ChainWave::move_free(const WaveArgs& p, RowId row, const float* required) noexcept {
  float* const u = row_at(p, row);
  const std::uint32_t free = info(row).free;
  std::uint32_t moves = 0;
  for (std::uint32_t i = 0; i < kRow; ++i) moves |= required[i] != u[i] ? 1U << i : 0U;
  if ((moves & ~free) != 0) note_pulled(p, row);
  moves &= free;
  for (std::uint32_t left = moves; left != 0; left &= left - 1) {
    const int i = __builtin_ctz(left);
    u[i] = required[i];
  }
  return static_cast<Moved>((moves != 0 ? kAnyMoved : kNothingMoved) | ((moves & 1U) != 0 ? kFirstMoved : 0) |
                            (moves >> (kRow - 1) != 0 ? kLastMoved : 0));
}

// relax_within() for a row with anchors. As long as no anchor is pulled, the row is relaxed as a whole.
// Otherwise it is relaxed voxel by voxel, because nothing may move on account of an anchor that stays.
Moved ChainWave::relax_within_anchored(const WaveArgs& p, RowId row) noexcept {
  std::array<float, kRow + 2> required;  // with one value beyond both ends, which the kernels read
  std::copy_n(row_at(p, row) - 1, required.size(), required.data());
  float* const own = required.data() + 1;
  const Moved moves = relax_within_by_label(p, row, own);
  if (moves == kNothingMoved) return moves;
  std::uint32_t lanes = 0;
  for (std::uint32_t i = 0; i < kRow; ++i) lanes |= own[i] != row_at(p, row)[i] ? 1U << i : 0U;
  if ((lanes & ~info(row).free) == 0) {
    std::copy_n(own, kRow, row_at(p, row));
    note_moved(row);
    return moves;
  }
  const VoxelId begin = row * kRow, end = begin + kRow - 1;
  for (VoxelId v = begin; v < end; ++v) {
    if (lattice_.filled(v)) relax_link(p, v, v + 1, 0);
  }
  for (VoxelId v = end; v > begin; --v) {
    if (lattice_.filled(v)) relax_link(p, v, v - 1, 1);
  }
  return kFirstMoved | kLastMoved;
}

Moved ChainWave::relax_within(const WaveArgs& p, RowId row) noexcept {
  float* const own = row_at(p, row);
  if (info(row).anchored) return relax_within_anchored(p, row);
  const std::uint8_t label = rows_[row].label;
  if (label != 0) {
    const float up = p.limits.between(0, label, label), down = p.limits.between(1, label, label);
    return p.way == Way::raise ? raise_along_alike(own, up, down, p.margin)
                               : lower_along_alike(own, up, down, p.margin);
  }
  return relax_within_by_label(p, row, own);
}

Moved ChainWave::relax_within_by_label(const WaveArgs& p, RowId row, float* u) noexcept {
  const HalfLimits up{p.limits.half[0], limits_.registers()}, down{p.limits.half[1], limits_.registers()};
  return p.way == Way::raise ? raise_along(u, lattice_.labels(row), up, down, p.margin)
                             : lower_along(u, lattice_.labels(row), up, down, p.margin);
}

void ChainWave::relax_neighbours(const WaveArgs& p, RowId row) noexcept {
  const Grid& grid = lattice_.grid();
  // The marks are cleared first, because a row with anchors may enqueue itself again.
  std::uint8_t ends = rows_[row].mark & (first | last);
  rows_[row].mark &= static_cast<std::uint8_t>(~(queued | first | last));
  ends |= relax_within(p, row);
  relax_beside(p, row, row + 1, 2);
  relax_beside(p, row, row - 1, 3);
  relax_beside(p, row, row + grid.row_z, 4);
  relax_beside(p, row, row - grid.row_z, 5);
  if ((ends & last) != 0) relax_across(p, row, row + grid.row_x, 0);
  if ((ends & first) != 0) relax_across(p, row, row - grid.row_x, 1);
}

// Prefetches the neighbours of a row further back in the queue, which lie at six places in memory.
inline void ChainWave::prefetch_around(const WaveArgs& p, RowId row) const noexcept {
  const Grid& grid = lattice_.grid();
  const RowInfo info = rows_[row];
  const auto fetch = [&](RowId r) {
    __builtin_prefetch(row_at(p, r));
    __builtin_prefetch(row_at(p, r) + kRow / 2);
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
    __builtin_prefetch(row_at(p, row - grid.row_x) + kRow / 2);
    __builtin_prefetch(&rows_[row - grid.row_x]);
    __builtin_prefetch(lattice_.labels(row - grid.row_x));
  }
}

std::uint64_t ChainWave::run_queue(const WaveArgs& p, std::uint64_t most) noexcept {
  std::uint64_t visits = 0;
  for (; head_ != tail_ && visits < most; ++visits) {
    const RowId row = ring_[head_];
    const std::size_t ahead = head_ + kPrefetchRows < ring_.size() ? head_ + kPrefetchRows : 0;
    prefetch_around(p, ring_[ahead]);  // beyond the queue's end: a stale row, which is harmless
    head_ = head_ + 1 == ring_.size() ? 0 : head_ + 1;
    relax_neighbours(p, row);
  }
  for (; head_ != tail_; head_ = head_ + 1 == ring_.size() ? 0 : head_ + 1) {
    rows_[ring_[head_]].mark &= static_cast<std::uint8_t>(~(queued | first | last));
    postpone(ring_[head_], wave_bit(p.axis, p.way));
  }
  work_ += visits;
  return visits;
}

void ChainWave::postpone(RowId row, std::uint8_t waves) noexcept {
  std::uint8_t& waits = rows_[row].waits;
  if ((waits & kListed) == 0) waiting_[waiting_count_++] = row;
  waits |= static_cast<std::uint8_t>(waves | kListed);
}

// Is any link of a voxel violated, or at its limit within the margin? Links within the margin count, too, so
// that passing waves repair violations by rounding. The limit to a missing neighbour is unbounded.
bool ChainWave::has_binding_link(const WaveArgs& p, VoxelId v) const noexcept {
  const std::uint8_t label = lattice_.label(v);
  for (int n = 0; n < kDirections; ++n) {
    const VoxelId to = n % 2 == 0 ? lattice_.up(v, n / 2) : lattice_.down(v, n / 2);
    const float limit = p.limits.between(n, label, lattice_.label(to));
    if (p.way == Way::raise ? p.u[v] - limit > p.u[to] - p.margin : p.u[v] + limit < p.u[to] + p.margin)
      return true;
  }
  return false;
}

std::uint64_t ChainWave::spread(float* u, int axis, Way way, std::span<Source> sources, float margin,
                                std::uint64_t most) noexcept {
  if (sources.empty()) return 0;
  WaveArgs p{u, axis, way, margin, limits_.for_wave(axis, way), {}};
  // The strongest source comes first, so that voxels that follow it need no second visit.
  std::sort(sources.begin(), sources.end(), [way](const Source& a, const Source& b) {
    if (a.u != b.u) return way == Way::raise ? a.u > b.u : a.u < b.u;
    return a.v < b.v;
  });
  const bool cones = lattice_.uniform_limits() && sources.size() <= kMaxCones;
  const std::uint8_t label = lattice_.label(sources.front().v);
  for (int n = 0; n < kDirections; ++n)
    p.limit[static_cast<std::size_t>(n)] = static_cast<double>(p.limits.between(n, label, label));
  cone_rows_ = 0;
  std::uint64_t visits = 0;
  const auto used = [&] { return visits + cone_rows_ / kConeRows; };
  const auto left = [&] { return used() < most ? most - used() : 0; };
  // Cones and sweeps require a state without violations, so no row may wait.
  const bool no_row_waits = waiting_count_ == 0;
  std::size_t moves = 0;
  for (const Source& s : sources) {
    note_moved(s.v / kRow);
    if (way == Way::raise ? s.u <= u[s.v] : s.u >= u[s.v])
      continue;  // a stronger source has moved it already
    u[s.v] = s.u;
    sources[moves++] = s;
    if (!cones || !has_binding_link(p, s.v)) continue;
    // Each source spreads before the next one.
    if (!no_row_waits || !cone(p, s.v, left())) {
      if (!no_row_waits || !sweep(p, {&s, 1}, left(), visits)) enqueue(s.v / kRow);
    }
    visits += run_queue(p, left());
  }
  if (!cones) {
    // The wave starts only from sources with a binding link. If a tool hardly moves, few of its pressed
    // voxels have one.
    const std::span<Source> moving = sources.first(moves);
    const auto binding = moving.first(
        static_cast<std::size_t>(std::remove_if(moving.begin(), moving.end(),
                                                [&](const Source& s) { return !has_binding_link(p, s.v); }) -
                                 moving.begin()));
    if (!binding.empty() && (!no_row_waits || !sweep(p, binding, left(), visits))) {
      for (const Source& s : binding) enqueue(s.v / kRow);
    }
  }
  visits += run_queue(p, left());
  work_ += cone_rows_ / kConeRows;
  return used();
}

std::uint64_t ChainWave::spread_from_pulled(float* u, int axis, Way way, float margin,
                                            std::uint64_t most) noexcept {
  const WaveArgs p{u, axis, way, margin, limits_.for_wave(axis, way), {}};
  const std::uint8_t bit = wave_bit(axis, way);
  for (std::size_t n = 0; n < pulled_count_; ++n) {
    if ((pulled_by_[pulled_[n]] & bit) != 0) enqueue(pulled_[n]);
  }
  return run_queue(p, most);
}

void ChainWave::take_waiting() noexcept {
  std::swap(waiting_, taken_);
  taken_count_ = std::exchange(waiting_count_, 0);
  for (std::size_t n = 0; n < taken_count_; ++n)
    rows_[taken_[n]].waits &= static_cast<std::uint8_t>(~kListed);
}

std::uint64_t ChainWave::spread_from_taken(float* u, int axis, Way way, float margin,
                                           std::uint64_t most) noexcept {
  const WaveArgs p{u, axis, way, margin, limits_.for_wave(axis, way), {}};
  const std::uint8_t bit = wave_bit(axis, way);
  std::uint64_t count = 0;
  for (std::size_t n = 0; n < taken_count_ && count < most; ++n) {
    std::uint8_t& waits = rows_[taken_[n]].waits;
    if ((waits & bit) == 0) continue;
    waits &= static_cast<std::uint8_t>(~bit);
    enqueue(taken_[n]);
    ++count;
  }
  return run_queue(p, most);
}

void ChainWave::put_back() noexcept {
  for (std::size_t n = 0; n < taken_count_; ++n) {
    if (rows_[taken_[n]].waits != 0) postpone(taken_[n], 0);
  }
  taken_count_ = 0;
}

std::size_t ChainWave::memory_bytes() const {
  return rows_.resident_bytes() + ring_.resident_bytes() + moved_.resident_bytes() +
         pulled_.resident_bytes() + pulled_by_.resident_bytes() + waiting_.resident_bytes() +
         taken_.resident_bytes() + pending_.resident_bytes() + resident_bytes(pending_ranges_) +
         resident_bytes(pending_in_plane_) + resident_bytes(moves_) + resident_bytes(fall_);
}

}  // namespace voxel
