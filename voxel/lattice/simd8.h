// SPDX-License-Identifier: GPL-3.0-or-later
// Eight floats at a time: the width all of today's machines have, and a quarter of a row.
// (Sixteen, where a machine has them, were rejected: with GCC 12 a row is smoothed in the same time, and
// passes that combine comparisons take 1.5 times as long.)
//
// Only for inside of functions marked HYBRID_WIDE: everything here is inlined into them. Vectors are passed
// by reference, since how they are passed by value depends on the machine.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "voxel/lattice/row_grid.h"

namespace voxel {

inline constexpr int kOctet = 8;               // lanes
inline constexpr int kOctets = kRow / kOctet;  // in a row

using Octet = float __attribute__((vector_size(32)));
using OctetMask = std::int32_t __attribute__((vector_size(32)));  // a lane is 0 or −1

// Octets first … last of a row, both included.
struct OctetSpan {
  int first = 0, last = kOctets - 1;

  [[nodiscard]] bool whole() const { return first == 0 && last == kOctets - 1; }
};

#define HYBRID_INLINE [[gnu::always_inline]] inline

HYBRID_INLINE void load(Octet& to, const float* from) {
  std::memcpy(&to, from, sizeof to);
}
HYBRID_INLINE void store(float* to, const Octet& from) {
  std::memcpy(to, &from, sizeof from);
}
// Lane i of `down` is lane i − 1 of the values that go on from `before` into `own`; of `up`, lane i + 1.
HYBRID_INLINE void shift_down(Octet& down, const Octet& before, const Octet& own) {
  down = __builtin_shufflevector(before, own, 7, 8, 9, 10, 11, 12, 13, 14);
}
HYBRID_INLINE void shift_up(Octet& up, const Octet& own, const Octet& after) {
  up = __builtin_shufflevector(own, after, 1, 2, 3, 4, 5, 6, 7, 8);
}
// Where the mask is set `a`, elsewhere `b`.
HYBRID_INLINE void select(Octet& out, const OctetMask& mask, const Octet& a, const Octet& b) {
  out = mask ? a : b;
}
HYBRID_INLINE void take_largest(Octet& most, const Octet& x) {
  most = x > most ? x : most;
}
HYBRID_INLINE void take_least(Octet& least, const Octet& x) {
  least = x < least ? x : least;
}
HYBRID_INLINE void take_largest_size(Octet& most, const Octet& x) {
  const Octet negative = -x;
  const Octet size = x > negative ? x : negative;
  most = size > most ? size : most;
}
HYBRID_INLINE float largest(const Octet& x) {
  Octet most = x;
  take_largest(most, Octet(__builtin_shufflevector(most, most, 4, 5, 6, 7, 4, 5, 6, 7)));
  take_largest(most, Octet(__builtin_shufflevector(most, most, 2, 3, 2, 3, 2, 3, 2, 3)));
  return most[1] > most[0] ? most[1] : most[0];
}
// Lanes whose byte has any of these bits.
HYBRID_INLINE void bits_set(OctetMask& out, const std::uint8_t* bytes, int bits) {
  using Bytes = std::uint8_t __attribute__((vector_size(8)));
  Bytes b;
  std::memcpy(&b, bytes, sizeof b);
  out = (__builtin_convertvector(b, OctetMask) & bits) != 0;
}

}  // namespace voxel
