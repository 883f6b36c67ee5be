// SPDX-License-Identifier: GPL-3.0-or-later
// Internal to the row passes: a Float8 of a row, its neighbours, and the springs between them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "voxel/lattice/simd8.h"
#include "voxel/multigrid/row_smoother.h"

namespace voxel {

// The springs of one axis of a row, by lane or (kUniform) one for all lanes.
struct AxisSprings {
  std::array<const float*, 3> up, down;
  const float* inverse;

  AxisSprings(const RowStiffness& s, std::size_t axis) : inverse(s.inverse + axis * kRow) {
    for (std::size_t d = 0; d < 3; ++d) {
      up[d] = (d == axis ? s.up_along : s.up_across) + d * kRow;
      down[d] = (d == axis ? s.down_along : s.down_across)[d];
    }
  }
};
template <bool kUniform>
HYBRID_INLINE void spring(Float8& k, const float* lanes, int group) {
  load(k, kUniform ? lanes : lanes + group * kLanes);
}

inline constexpr Mask8 kEven{-1, 0, -1, 0, -1, 0, -1, 0};  // selects the even lanes

// The Float8 of a span, and one more at both ends, of which only the lane next to the span is valid.
struct Span {
  std::array<Float8, kLaneGroups + 2> at;
};
HYBRID_INLINE void ends_of(Span& s, const float* own, std::ptrdiff_t x, LaneSpan span) {
  const float before = span.first > 0 ? own[span.first * kLanes - 1] : own[kRow - 1 - x];
  const float after = span.last < kLaneGroups - 1 ? own[(span.last + 1) * kLanes] : own[x];
  s.at[0] = Float8{} + before;
  s.at[static_cast<std::size_t>(span.last - span.first) + 2] = Float8{} + after;
}

// A Float8 of a row, and its neighbours in y and z.
struct Around {
  Float8 own, y_down, y_up, z_down, z_up;
};
HYBRID_INLINE void look_around(Around& at, const float* own, std::ptrdiff_t z) {
  load(at.own, own);
  load(at.y_down, own - kRow);
  load(at.y_up, own + kRow);
  load(at.z_down, own - z);
  load(at.z_up, own + z);
}
HYBRID_INLINE bool any(const Mask8& mask) {
  std::array<std::uint64_t, 4> words;
  std::memcpy(words.data(), &mask, sizeof words);
  return (words[0] | words[1] | words[2] | words[3]) != 0;
}

// Lanes that are anchored or held.
HYBRID_INLINE void standing(Mask8& stands, const LevelRow& row, const Float8& inverse, int group) {
  stands = inverse == 0.0F;
  if (row.held != nullptr) {
    Mask8 bits;
    bits_set(bits, row.held + group * kLanes, 1);
    stands |= bits;
  }
}
// Lanes that are anchored or held, for one axis. Anchored lanes are read from bits.
HYBRID_INLINE void standing_by_bits(Mask8& stands, const LevelRow& row, std::size_t axis, int group) {
  bits_set(stands, row.springs.stands + group * kLanes, 1 << axis);
  if (row.held != nullptr) {
    Mask8 bits;
    bits_set(bits, row.held + group * kLanes, 1);
    stands |= bits;
  }
}
// Lanes that do not move on an axis.
HYBRID_INLINE void staying(Mask8& stays, const LevelRow& row, const Float8& inverse, std::size_t axis,
                           int group) {
  standing(stays, row, inverse, group);
  if (row.stopped != nullptr) {
    Mask8 bits;
    bits_set(bits, row.stopped + group * kLanes, 1 << axis);
    stays |= bits;
  }
}

// One spring of a Float8; `axis` and `d` are known at compile time.
template <bool kUniform>
HYBRID_INLINE void spring_up(Float8& k, const RowStiffness& s, std::size_t axis, std::size_t d, int group) {
  load(k, (d == axis ? s.up_along : s.up_across) + d * kRow + (kUniform ? 0 : group * kLanes));
}
template <bool kUniform>
HYBRID_INLINE void spring_down(Float8& k, const RowStiffness& s, std::size_t axis, std::size_t d, int group) {
  load(k, (d == axis ? s.down_along : s.down_across)[d] + (kUniform ? 0 : group * kLanes));
}
template <bool kUniform>
HYBRID_INLINE void inverse_of(Float8& inverse, const RowStiffness& s, std::size_t axis, int group) {
  load(inverse, s.inverse + axis * kRow + (kUniform ? 0 : group * kLanes));
}
// Displacements on all axes. They are processed side by side, because one axis alone is a chain of dependent
// operations.
using Axes = std::array<std::array<Float8, kLaneGroups + 2>, 3>;

HYBRID_INLINE void load_axes(Axes& u, const LevelRow& row, LaneSpan span) {
  const int count = span.last - span.first + 1;
#pragma GCC unroll 3
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float* own = row.u[axis];
    const float before = span.first > 0 ? own[span.first * kLanes - 1] : own[kRow - 1 - row.x];
    const float after = span.last < kLaneGroups - 1 ? own[(span.last + 1) * kLanes] : own[row.x];
    u[axis][0] = Float8{} + before;
    u[axis][static_cast<std::size_t>(count) + 1] = Float8{} + after;
  }
#pragma GCC unroll 1
  for (int n = 0; n < count; ++n) {
#pragma GCC unroll 3
    for (std::size_t axis = 0; axis < 3; ++axis)
      load(u[axis][static_cast<std::size_t>(n) + 1], row.u[axis] + (span.first + n) * kLanes);
  }
}

}  // namespace voxel
