// SPDX-License-Identifier: GPL-3.0-or-later
// Rows of the chain in vectors of 8 floats, for row_kernels.cpp and sweep_kernel.cpp alone. lanes16.h has the
// same functions for vectors of 16.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "voxel/chain/row_kernels.h"
#include "voxel/lattice/row_grid.h"

// These functions are inlined into the functions of every width, whatever their size.
#define HYBRID_INLINE inline __attribute__((always_inline))

namespace voxel::lanes8 {

// Vectors are explicit, because from plain loops the compiler generates neither table look-ups in registers
// nor the test whether any lane moves. Where registers are narrower, it splits these vectors.
constexpr std::size_t kWidth = 8, kVectors = kRow / kWidth;
using Floats = float __attribute__((vector_size(4 * kWidth)));
using Masks = std::int32_t __attribute__((vector_size(4 * kWidth)));

HYBRID_INLINE void load(const float* at, Floats& out) {
  std::memcpy(&out, at, sizeof out);
}
HYBRID_INLINE void store(const Floats& value, float* at) {
  std::memcpy(at, &value, sizeof value);
}
HYBRID_INLINE void broadcast(float value, Floats& out) {
  out = Floats{} + value;
}
// Lane n of `out` is lane n − kBy (shift_up_by) or n + kBy (shift_down_by) of two consecutive vectors. kBy is
// 0, 1, 2 or 4.
template <std::size_t kBy>
HYBRID_INLINE void shift_up_by(const Floats& before, const Floats& value, Floats& out) {
  static_assert(kBy < kWidth);
  out = kBy == 0   ? value
        : kBy == 1 ? __builtin_shufflevector(before, value, 7, 8, 9, 10, 11, 12, 13, 14)
        : kBy == 2 ? __builtin_shufflevector(before, value, 6, 7, 8, 9, 10, 11, 12, 13)
                   : __builtin_shufflevector(before, value, 4, 5, 6, 7, 8, 9, 10, 11);
}
template <std::size_t kBy>
HYBRID_INLINE void shift_down_by(const Floats& value, const Floats& after, Floats& out) {
  static_assert(kBy < kWidth);
  out = kBy == 0   ? value
        : kBy == 1 ? __builtin_shufflevector(value, after, 1, 2, 3, 4, 5, 6, 7, 8)
        : kBy == 2 ? __builtin_shufflevector(value, after, 2, 3, 4, 5, 6, 7, 8, 9)
                   : __builtin_shufflevector(value, after, 4, 5, 6, 7, 8, 9, 10, 11);
}
HYBRID_INLINE void select(const Masks& mask, const Floats& there, const Floats& elsewhere, Floats& out) {
  out = mask ? there : elsewhere;
}
HYBRID_INLINE bool any_of(const Masks& mask) {
  std::array<std::int64_t, kWidth / 2> halves;
  std::memcpy(halves.data(), &mask, sizeof mask);
  return (halves[0] | halves[1] | halves[2] | halves[3]) != 0;
}

// A table of half limits. Registers hold its first 16 values.
struct Table {
  const float* values;
  Floats low, high;

  HYBRID_INLINE explicit Table(const float* table) : values(table) {
    load(table, low);
    load(table + kWidth, high);
  }
};

// Labels of a row, widened to the width of the values that they look up.
struct Indices {
  alignas(32) std::array<std::int32_t, kRow> at;

  HYBRID_INLINE explicit Indices(const std::uint8_t* labels) {
    for (std::size_t i = 0; i < at.size(); ++i) at[i] = labels[i];
  }
};

template <int kRegisters>
HYBRID_INLINE void look_up(const Table& table, const Indices& indices, std::size_t i, Floats& out) {
#if !defined(__clang__)
  if (kRegisters > 0) {
    Masks index;
    std::memcpy(&index, indices.at.data() + i, sizeof index);
    out = kRegisters == 1 ? __builtin_shuffle(table.low, index)
                          : __builtin_shuffle(table.low, table.high, index);
    return;
  }
#endif
  Floats values{};
  for (std::size_t n = 0; n < kWidth; ++n) values[n] = table.values[indices.at[i + n]];
  out = values;
}

template <bool kRaise>
HYBRID_INLINE void require(const Floats& from, const Floats& limit, Floats& required) {
  required = kRaise ? from - limit : from + limit;
}
template <bool kRaise>
HYBRID_INLINE void take_stronger(const Floats& required, Floats& now) {
  now = (kRaise ? required > now : required < now) ? required : now;
}
template <bool kRaise>
HYBRID_INLINE float required_value(float from, float limit) {
  return kRaise ? from - limit : from + limit;
}
template <bool kRaise>
HYBRID_INLINE bool exceeds(float required, float now, float margin) {
  return kRaise ? required > now + margin : required < now - margin;
}
template <bool kRaise>
HYBRID_INLINE void compare(const Floats& required, const Floats& now, float margin, Masks& moves) {
  moves = kRaise ? required > now + margin : required < now - margin;
}

HYBRID_INLINE Moved moved(const Masks& front, const Masks& back) {
  return static_cast<Moved>(kAnyMoved | (front[0] & kFirstMoved) | (back[kWidth - 1] & kLastMoved));
}

}  // namespace voxel::lanes8
