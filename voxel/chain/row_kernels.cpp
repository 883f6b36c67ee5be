// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/chain/row_kernels.h"

#include <array>

#include "voxel/chain/lanes8.h"
#include "voxel/lattice/simd_dispatch.h"

namespace voxel {
namespace {

using namespace lanes8;

// Relaxes the links from row `from` to row `to`. `limit_of(i, out)`: limits of the links of lanes i … i +
// kWidth − 1.
template <bool kRaise, class LimitOf>
HYBRID_INLINE Moved beside(const float* from, float* to, float margin, const LimitOf& limit_of) {
  std::array<Floats, kVectors> result;
  std::array<Masks, kVectors> moves;
  Masks any{};
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kVectors; ++n) {
    const std::size_t i = n * kWidth;
    Floats own, now, limit, required;
    load(from + i, own);
    load(to + i, now);
    limit_of(i, limit);
    require<kRaise>(own, limit, required);
    compare<kRaise>(required, now, margin, moves[n]);
    any |= moves[n];
    result[n] = moves[n] ? required : now;
  }
  if (!any_of(any)) return kNothingMoved;
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kVectors; ++n) store(result[n], to + n * kWidth);
  return moved(moves.front(), moves.back());
}

// Relaxes all links of the row at once, until no voxel moves. Most rows have their values from the rows
// beside them already, so one or two rounds suffice. A sequential pass from end to end takes longer even if a
// wave runs along the whole row. `below(i, out)`: limits of the links below lanes i … i + kWidth − 1.
// `above`: limits of the links above them.
template <bool kRaise, class Below, class Above>
HYBRID_INLINE Moved along(float* row, float margin, const Below& below, const Above& above) {
  std::array<Floats, kVectors> now, from_below, from_above;
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kVectors; ++n) {
    load(row + n * kWidth, now[n]);
    below(n * kWidth, from_below[n]);
    above(n * kWidth, from_above[n]);
  }
  from_below[0][0] = from_above[kVectors - 1][kWidth - 1] = kUnbounded;
  Masks front{}, back{};
  for (bool first = true;; first = false) {
    std::array<Floats, kVectors> required;
    std::array<Masks, kVectors> moves;
    Masks any{};
#pragma GCC unroll 4
    for (std::size_t n = 0; n < kVectors; ++n) {
      Floats left, right, a, b;
      shift_up_by<1>(now[n == 0 ? 0 : n - 1], now[n], left);
      shift_down_by<1>(now[n], now[n + 1 == kVectors ? n : n + 1], right);
      require<kRaise>(left, from_below[n], a);
      require<kRaise>(right, from_above[n], b);
      required[n] = (kRaise ? a > b : a < b) ? a : b;
      compare<kRaise>(required[n], now[n], margin, moves[n]);
      any |= moves[n];
    }
    if (!any_of(any)) {
      if (first) return kNothingMoved;
      break;
    }
    front |= moves[0];
    back |= moves[kVectors - 1];
#pragma GCC unroll 4
    for (std::size_t n = 0; n < kVectors; ++n) now[n] = moves[n] ? required[n] : now[n];
  }
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kVectors; ++n) store(now[n], row + n * kWidth);
  return moved(front, back);
}

template <bool kRaise, int kRegisters>
HYBRID_INLINE Moved beside_by_label(const float* from, const std::uint8_t* from_labels, float* to,
                                    const std::uint8_t* to_labels, const float* half, float margin) {
  const Table table(half);
  const Indices own(from_labels), others(to_labels);
  return beside<kRaise>(
      from, to, margin, [&](std::size_t i, Floats & limit) __attribute__((always_inline)) {
        Floats other;
        look_up<kRegisters>(table, own, i, limit);
        look_up<kRegisters>(table, others, i, other);
        limit += other;
      });
}

template <bool kRaise, int kRegisters>
HYBRID_INLINE Moved along_by_label(float* row, const std::uint8_t* labels, const float* up, const float* down,
                                   float margin) {
  const Table table_up(up), table_down(down);
  const Indices left(labels - 1), own(labels), right(labels + 1);
  return along<kRaise>(
      row, margin,
      [&](std::size_t i, Floats & limit) __attribute__((always_inline)) {
        Floats other;
        look_up<kRegisters>(table_up, left, i, limit);
        look_up<kRegisters>(table_up, own, i, other);
        limit += other;
      },
      [&](std::size_t i, Floats & limit) __attribute__((always_inline)) {
        Floats other;
        look_up<kRegisters>(table_down, own, i, limit);
        look_up<kRegisters>(table_down, right, i, other);
        limit += other;
      });
}

template <bool kRaise>
HYBRID_INLINE Moved beside_alike(const float* from, float* to, float limit, float margin) {
  return beside<kRaise>(
      from, to,
      margin, [limit](std::size_t, Floats & out) __attribute__((always_inline)) { out = Floats{} + limit; });
}
template <bool kRaise>
HYBRID_INLINE Moved along_alike(float* row, float up, float down, float margin) {
  return along<kRaise>(
      row, margin, [up](std::size_t, Floats & out) __attribute__((always_inline)) { out = Floats{} + up; },
      [down](std::size_t, Floats & out) __attribute__((always_inline)) { out = Floats{} + down; });
}

// Half a row: one cache line, and one register of AVX-512.
constexpr int kHalf = kRow / 2;
constexpr int kConePrefetchRows = 12;  // rows ahead
// A row that is raised by at least this many margins is raised by clearly more than rounding.
constexpr float kClearMargins = 16.0F;
using Line = float __attribute__((vector_size(4 * kHalf)));
HYBRID_INLINE float apex_at(const ConeColumn& c, int n) {
  return static_cast<float>(c.apex + n * (n < 0 ? c.slope_down : c.slope_up));
}
struct ConeHalf {
  Line fall;
  int first;  // lane
  float least_fall;
  int nearest;  // lane with the least fall
  HYBRID_INLINE ConeHalf(const float* falls, int lane, int nearest_lane)
      : first(lane), least_fall(falls[nearest_lane]), nearest(nearest_lane) {
    std::memcpy(&fall, falls + lane, sizeof fall);
  }
  template <bool kRaise>
  [[nodiscard]] HYBRID_INLINE bool is_raised(const ConeColumn& c, int n, float margin) const {
    return exceeds<kRaise>(required_value<kRaise>(apex_at(c, n), least_fall), c.own[n * kRow + nearest],
                           margin);
  }
  // Number of consecutive rows raised, upwards or downwards from row 0. If the guessed row is raised by
  // clearly more than rounding, all rows before it are raised, too. Then the search begins at the guessed
  // row.
  template <bool kRaise, int kStep>
  [[nodiscard]] HYBRID_INLINE int end(const ConeColumn& c, int guess, int most, float margin) const {
    int n = guess > most ? most : guess;
    if (n < 0 || !is_raised<kRaise>(c, n * kStep, kClearMargins * margin)) n = 0;
    while (n < most && is_raised<kRaise>(c, (n + 1) * kStep, margin)) ++n;
    return n;
  }
  template <bool kRaise>
  HYBRID_INLINE void write(float* row, float apex) const {
    Line now;
    std::memcpy(&now, row + first, sizeof now);
    const Line required = kRaise ? (Line{} + apex) - fall : (Line{} + apex) + fall;
    now = (kRaise ? required > now : required < now) ? required : now;
    std::memcpy(row + first, &now, sizeof now);
  }
};

// Rows are written from one end to the other, the two halves of a row together, so that the hardware
// prefetcher can follow.
template <bool kRaise>
HYBRID_INLINE bool cone(const ConeColumn& c, float margin, ConeEnds& ends) {
  const bool in_upper = c.nearest >= kHalf;
  const ConeHalf near(c.fall, in_upper ? kHalf : 0, c.nearest),
      far(c.fall, in_upper ? 0 : kHalf, in_upper ? kHalf - 1 : kHalf);
  if (!c.has_apex && !near.is_raised<kRaise>(c, 0, margin)) return false;
  const bool both = far.is_raised<kRaise>(c, 0, margin);
  ends.near_up = near.end<kRaise, 1>(c, ends.near_up, c.up, margin);
  ends.near_down = near.end<kRaise, -1>(c, ends.near_down, c.down, margin);
  ends.far_up = both ? far.end<kRaise, 1>(c, ends.far_up, ends.near_up, margin) : 0;
  ends.far_down = both ? far.end<kRaise, -1>(c, ends.far_down, ends.near_down, margin) : 0;
  const int both_from = both ? -ends.far_down : ends.near_up + 1, both_to = both ? ends.far_up : ends.near_up;
  const auto write_near = [&](int n, int to) __attribute__((always_inline)) {
    for (; n < to; ++n) {
      float* const row = c.own + n * kRow;
      __builtin_prefetch(row + c.next + near.first, 1);
      near.write<kRaise>(row, apex_at(c, n));
    }
  };
  write_near(-ends.near_down, both_from);
  for (int n = both_from; n <= both_to; ++n) {
    float* const row = c.own + n * kRow;
    __builtin_prefetch(row + c.next, 1);
    __builtin_prefetch(row + c.next + kHalf, 1);
    const float* const ahead =
        row + (both_to - n < kConePrefetchRows ? both_to - n : kConePrefetchRows) * kRow;
    __builtin_prefetch(ahead, 1);
    __builtin_prefetch(ahead + kHalf, 1);
    const float apex = apex_at(c, n);
    near.write<kRaise>(row, apex);
    far.write<kRaise>(row, apex);
  }
  write_near(both_to + 1, ends.near_up + 1);
  return true;
}

}  // namespace

HYBRID_MULTIVERSIONED_512 Moved raise_beside(const float* from, const std::uint8_t* from_labels, float* to,
                                             const std::uint8_t* to_labels, const HalfLimits& half,
                                             float margin) noexcept {
  switch (half.registers) {
    case 1:
      return beside_by_label<true, 1>(from, from_labels, to, to_labels, half.table, margin);
    case 2:
      return beside_by_label<true, 2>(from, from_labels, to, to_labels, half.table, margin);
    default:
      return beside_by_label<true, 0>(from, from_labels, to, to_labels, half.table, margin);
  }
}
HYBRID_MULTIVERSIONED_512 Moved lower_beside(const float* from, const std::uint8_t* from_labels, float* to,
                                             const std::uint8_t* to_labels, const HalfLimits& half,
                                             float margin) noexcept {
  switch (half.registers) {
    case 1:
      return beside_by_label<false, 1>(from, from_labels, to, to_labels, half.table, margin);
    case 2:
      return beside_by_label<false, 2>(from, from_labels, to, to_labels, half.table, margin);
    default:
      return beside_by_label<false, 0>(from, from_labels, to, to_labels, half.table, margin);
  }
}
HYBRID_MULTIVERSIONED_512 Moved raise_beside_alike(const float* from, float* to, float limit,
                                                   float margin) noexcept {
  return beside_alike<true>(from, to, limit, margin);
}
HYBRID_MULTIVERSIONED_512 Moved lower_beside_alike(const float* from, float* to, float limit,
                                                   float margin) noexcept {
  return beside_alike<false>(from, to, limit, margin);
}

HYBRID_MULTIVERSIONED_512 Moved raise_along(float* row, const std::uint8_t* labels, const HalfLimits& up,
                                            const HalfLimits& down, float margin) noexcept {
  switch (up.registers) {
    case 1:
      return along_by_label<true, 1>(row, labels, up.table, down.table, margin);
    case 2:
      return along_by_label<true, 2>(row, labels, up.table, down.table, margin);
    default:
      return along_by_label<true, 0>(row, labels, up.table, down.table, margin);
  }
}
HYBRID_MULTIVERSIONED_512 Moved lower_along(float* row, const std::uint8_t* labels, const HalfLimits& up,
                                            const HalfLimits& down, float margin) noexcept {
  switch (up.registers) {
    case 1:
      return along_by_label<false, 1>(row, labels, up.table, down.table, margin);
    case 2:
      return along_by_label<false, 2>(row, labels, up.table, down.table, margin);
    default:
      return along_by_label<false, 0>(row, labels, up.table, down.table, margin);
  }
}
HYBRID_MULTIVERSIONED_512 Moved raise_along_alike(float* row, float up, float down, float margin) noexcept {
  return along_alike<true>(row, up, down, margin);
}
HYBRID_MULTIVERSIONED_512 Moved lower_along_alike(float* row, float up, float down, float margin) noexcept {
  return along_alike<false>(row, up, down, margin);
}

HYBRID_MULTIVERSIONED_512 bool raise_cone(const ConeColumn& column, float margin, ConeEnds& ends) noexcept {
  return cone<true>(column, margin, ends);
}
HYBRID_MULTIVERSIONED_512 bool lower_cone(const ConeColumn& column, float margin, ConeEnds& ends) noexcept {
  return cone<false>(column, margin, ends);
}

}  // namespace voxel
