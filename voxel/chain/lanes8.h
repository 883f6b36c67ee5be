// SPDX-License-Identifier: GPL-3.0-or-later
// Rows of the chain in vectors: what row_kernels.cpp and sweep_kernel.cpp are written in. Not for others.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "voxel/chain/row_kernels.h"
#include "voxel/lattice/row_grid.h"

// Inlined into both widths, whatever the compiler thinks of its size.
#define HYBRID_INLINE inline __attribute__((always_inline))

namespace voxel::lanes {

// Vectors by name, since the compiler finds neither the look-up in registers nor the question whether any
// lane moves in plain loops. Where registers are narrower, it takes them apart.
constexpr std::size_t kWidth = 8, kVectors = kRow / kWidth;
using Floats = float __attribute__((vector_size(4 * kWidth)));
using Masks = std::int32_t __attribute__((vector_size(4 * kWidth)));

constexpr float kNever = 1e30F;

HYBRID_INLINE void load(const float* at, Floats& out) {
  std::memcpy(&out, at, sizeof out);
}
HYBRID_INLINE void store(const Floats& value, float* at) {
  std::memcpy(at, &value, sizeof value);
}
HYBRID_INLINE void broadcast(float value, Floats& out) {
  out = Floats{} + value;
}
// Lanes n − kBy …, n + kBy …, kBy a power of two.
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

// A table of half limits, in registers where it fits.
struct Table {
  const float* values;
  Floats low, high;

  HYBRID_INLINE explicit Table(const float* table) : values(table) {
    load(table, low);
    load(table + kWidth, high);
  }
};

// Labels of a row, as wide as what they stand for.
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
HYBRID_INLINE void ask(const Floats& from, const Floats& limit, Floats& wanted) {
  wanted = kRaise ? from - limit : from + limit;
}
template <bool kRaise>
HYBRID_INLINE void take_stronger(const Floats& wanted, Floats& now) {
  now = (kRaise ? wanted > now : wanted < now) ? wanted : now;
}
template <bool kRaise>
HYBRID_INLINE float asked(float from, float limit) {
  return kRaise ? from - limit : from + limit;
}
template <bool kRaise>
HYBRID_INLINE bool beyond(float wanted, float now, float margin) {
  return kRaise ? wanted > now + margin : wanted < now - margin;
}
template <bool kRaise>
HYBRID_INLINE void compare(const Floats& wanted, const Floats& now, float margin, Masks& moves) {
  moves = kRaise ? wanted > now + margin : wanted < now - margin;
}

HYBRID_INLINE Moved moved(const Masks& front, const Masks& back) {
  return static_cast<Moved>(kAnyMoved | (front[0] & kFirstMoved) | (back[kWidth - 1] & kLastMoved));
}

}  // namespace voxel::lanes
