// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/chain_rows.h"

#include <array>

#include "voxel/chain_lanes.h"
#include "voxel/wide.h"

namespace voxel {
namespace {

using namespace lanes;

// `limit_of(i, out)`: limits of the links of lanes i to i + kWidth.
template <bool kRaise, class LimitOf>
HYBRID_INLINE Moved beside(const float* from, float* to, float margin, const LimitOf& limit_of) {
  std::array<Floats, kVectors> result;
  std::array<Masks, kVectors> moves;
  Masks any{};
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kVectors; ++n) {
    const std::size_t i = n * kWidth;
    Floats own, now, limit, wanted;
    load(from + i, own);
    load(to + i, now);
    limit_of(i, limit);
    ask<kRaise>(own, limit, wanted);
    compare<kRaise>(wanted, now, margin, moves[n]);
    any |= moves[n];
    result[n] = moves[n] ? wanted : now;
  }
  if (!any_of(any)) return kNothingMoved;
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kVectors; ++n) store(result[n], to + n * kWidth);
  return moved(moves.front(), moves.back());
}

// Each voxel asks the next one on either side, all at once, until none moves: most rows have what they need
// from the rows beside them, and a glance or two show it. A walk from end to end, one voxel after the other,
// takes longer even where a wave runs all along the row. `below(i, out)`: limits between lanes i − 1 … and
// i …, `above`: between i … and i + 1 ….
template <bool kRaise, class Below, class Above>
HYBRID_INLINE Moved along(float* row, float margin, const Below& below, const Above& above) {
  std::array<Floats, kVectors> now, from_below, from_above;
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kVectors; ++n) {
    load(row + n * kWidth, now[n]);
    below(n * kWidth, from_below[n]);
    above(n * kWidth, from_above[n]);
  }
  from_below[0][0] = from_above[kVectors - 1][kWidth - 1] = kNever;
  Masks front{}, back{};
  for (bool first = true;; first = false) {
    std::array<Floats, kVectors> wanted;
    std::array<Masks, kVectors> moves;
    Masks any{};
#pragma GCC unroll 4
    for (std::size_t n = 0; n < kVectors; ++n) {
      Floats left, right, a, b;
      shift_up(now[n == 0 ? 0 : n - 1], now[n], left);
      shift_down(now[n], now[n + 1 == kVectors ? n : n + 1], right);
      ask<kRaise>(left, from_below[n], a);
      ask<kRaise>(right, from_above[n], b);
      wanted[n] = (kRaise ? a > b : a < b) ? a : b;
      compare<kRaise>(wanted[n], now[n], margin, moves[n]);
      any |= moves[n];
    }
    if (!any_of(any)) {
      if (first) return kNothingMoved;
      break;
    }
    front |= moves[0];
    back |= moves[kVectors - 1];
#pragma GCC unroll 4
    for (std::size_t n = 0; n < kVectors; ++n) now[n] = moves[n] ? wanted[n] : now[n];
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

template <bool kRaise>
HYBRID_INLINE int cone(const ConeRows& rows, double apex, double per_row, const float* fall, int nearest,
                       float margin) {
  Floats f0, f1;
  load(fall, f0);
  load(fall + kWidth, f1);
  const float least = fall[nearest];
  float* row = rows.first;
  for (int n = 0; n < rows.most; ++n, row += rows.step) {
    __builtin_prefetch(row + rows.next);
    const auto base = static_cast<float>(kRaise ? apex - n * per_row : apex + n * per_row);
    if (!beyond<kRaise>(asked<kRaise>(base, least), row[nearest], margin)) {
      __builtin_prefetch(row + rows.next + rows.step);
      return n;
    }
    Floats a, b, now_a, now_b;
    load(row, now_a);
    load(row + kWidth, now_b);
    ask<kRaise>(Floats{} + base, f0, a);
    ask<kRaise>(Floats{} + base, f1, b);
    store((kRaise ? a > now_a : a < now_a) ? a : now_a, row);
    store((kRaise ? b > now_b : b < now_b) ? b : now_b, row + kWidth);
  }
  return rows.most;
}

}  // namespace

HYBRID_WIDE_AND_MANY Moved raise_beside(const float* from, const std::uint8_t* from_labels, float* to,
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
HYBRID_WIDE_AND_MANY Moved lower_beside(const float* from, const std::uint8_t* from_labels, float* to,
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
HYBRID_WIDE_AND_MANY Moved raise_beside_alike(const float* from, float* to, float limit,
                                              float margin) noexcept {
  return beside_alike<true>(from, to, limit, margin);
}
HYBRID_WIDE_AND_MANY Moved lower_beside_alike(const float* from, float* to, float limit,
                                              float margin) noexcept {
  return beside_alike<false>(from, to, limit, margin);
}

HYBRID_WIDE_AND_MANY Moved raise_along(float* row, const std::uint8_t* labels, const HalfLimits& up,
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
HYBRID_WIDE_AND_MANY Moved lower_along(float* row, const std::uint8_t* labels, const HalfLimits& up,
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
HYBRID_WIDE_AND_MANY Moved raise_along_alike(float* row, float up, float down, float margin) noexcept {
  return along_alike<true>(row, up, down, margin);
}
HYBRID_WIDE_AND_MANY Moved lower_along_alike(float* row, float up, float down, float margin) noexcept {
  return along_alike<false>(row, up, down, margin);
}

HYBRID_WIDE_AND_MANY int raise_cone(const ConeRows& rows, double apex, double per_row, const float* fall,
                                    int nearest, float margin) noexcept {
  return cone<true>(rows, apex, per_row, fall, nearest, margin);
}
HYBRID_WIDE_AND_MANY int lower_cone(const ConeRows& rows, double apex, double per_row, const float* fall,
                                    int nearest, float margin) noexcept {
  return cone<false>(rows, apex, per_row, fall, nearest, margin);
}

}  // namespace voxel
