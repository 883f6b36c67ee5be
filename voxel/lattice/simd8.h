// SPDX-License-Identifier: GPL-3.0-or-later
// Vectors of eight floats, a quarter of a row: the width of AVX2.
//
// Use only inside functions marked HYBRID_MULTIVERSIONED: everything here is inlined into them. Vectors are
// passed by reference, because the calling convention by value depends on the target machine.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "voxel/lattice/row_grid.h"

namespace voxel {

inline constexpr int kLanes = 8;                   // lanes of a vector
inline constexpr int kLaneGroups = kRow / kLanes;  // lane groups of a row

using Float8 = float __attribute__((vector_size(32)));
using Mask8 = std::int32_t __attribute__((vector_size(32)));  // a lane is 0 or −1

// Lane groups first … last of a row, inclusive.
struct LaneSpan {
  int first = 0, last = kLaneGroups - 1;

  [[nodiscard]] bool whole() const { return first == 0 && last == kLaneGroups - 1; }
};

#define HYBRID_INLINE [[gnu::always_inline]] inline

HYBRID_INLINE void load(Float8& to, const float* from) {
  std::memcpy(&to, from, sizeof to);
}
HYBRID_INLINE void store(float* to, const Float8& from) {
  std::memcpy(to, &from, sizeof from);
}
// Shifts by one lane. Lane i of `down` is lane i − 1 of `own`; lane 0 is the last lane of `before`. Lane i of
// `up` is lane i + 1 of `own`; the last lane is the first lane of `after`.
HYBRID_INLINE void shift_down(Float8& down, const Float8& before, const Float8& own) {
  down = __builtin_shufflevector(before, own, 7, 8, 9, 10, 11, 12, 13, 14);
}
HYBRID_INLINE void shift_up(Float8& up, const Float8& own, const Float8& after) {
  up = __builtin_shufflevector(own, after, 1, 2, 3, 4, 5, 6, 7, 8);
}
// Per lane: `a` if the mask is set, else `b`.
HYBRID_INLINE void select(Float8& out, const Mask8& mask, const Float8& a, const Float8& b) {
  out = mask ? a : b;
}
HYBRID_INLINE void take_largest(Float8& most, const Float8& x) {
  most = x > most ? x : most;
}
HYBRID_INLINE void take_least(Float8& least, const Float8& x) {
  least = x < least ? x : least;
}
HYBRID_INLINE void take_largest_size(Float8& most, const Float8& x) {
  const Float8 negative = -x;
  const Float8 size = x > negative ? x : negative;
  most = size > most ? size : most;
}
HYBRID_INLINE float largest(const Float8& x) {
  Float8 most = x;
  take_largest(most, Float8(__builtin_shufflevector(most, most, 4, 5, 6, 7, 4, 5, 6, 7)));
  take_largest(most, Float8(__builtin_shufflevector(most, most, 2, 3, 2, 3, 2, 3, 2, 3)));
  return most[1] > most[0] ? most[1] : most[0];
}
// Mask of the lanes whose byte has any of these bits.
HYBRID_INLINE void bits_set(Mask8& out, const std::uint8_t* bytes, int bits) {
  using Bytes = std::uint8_t __attribute__((vector_size(8)));
  Bytes b;
  std::memcpy(&b, bytes, sizeof b);
  out = (__builtin_convertvector(b, Mask8) & bits) != 0;
}

// Bit i is set if lane i of the mask is set.
HYBRID_INLINE std::uint32_t lanes_set(const Mask8& mask) {
  std::array<std::int32_t, kLanes> lanes;
  std::memcpy(lanes.data(), &mask, sizeof mask);
  std::uint32_t bits = 0;
  for (std::uint32_t i = 0; i < kLanes; ++i) bits |= (lanes[i] != 0 ? 1U : 0U) << i;
  return bits;
}

}  // namespace voxel
