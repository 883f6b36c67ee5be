// SPDX-License-Identifier: GPL-3.0-or-later
// Residual of a row, and its links at their limits.
#include "voxel/lattice/simd_dispatch.h"
#include "voxel/multigrid/row_limits.h"
#include "voxel/multigrid/row_smoother.h"
#include "voxel/multigrid/row_stencil.h"

namespace voxel {
namespace {

template <bool kUniform, Limits kLimits>
HYBRID_INLINE void residual_axis(RowResidual& result, const LevelRow& row, const AxisBounds& bounds,
                                 std::size_t axis, float tight, LaneSpan span, float* out, Float8& most_N,
                                 Float8& most_m) {
  const AxisSprings s(row.springs, axis);
  const float* own = row.u[axis];
  Span u;
  const Band band(bounds.row, tight);
  ends_of(u, own, row.x, span);
  const int count = span.last - span.first + 1;
#pragma GCC unroll 1
  for (int n = 0; n < count; ++n)
    load(u.at[static_cast<std::size_t>(n) + 1], own + (span.first + n) * kLanes);
#pragma GCC unroll 1
  for (int n = 0; n < count; ++n) {
    const int group = span.first + n;
    const auto un = static_cast<std::size_t>(n);
    Around at;
    look_around(at, own + group * kLanes, row.z);
    Float8 x_down, x_up, kxd, kxu, kyd, kyu, kzd, kzu, inverse;
    shift_down(x_down, u.at[un], at.own);
    shift_up(x_up, at.own, u.at[un + 2]);
    spring<kUniform>(kxd, s.down[0], group);
    spring<kUniform>(kxu, s.up[0], group);
    spring<kUniform>(kyd, s.down[1], group);
    spring<kUniform>(kyu, s.up[1], group);
    spring<kUniform>(kzd, s.down[2], group);
    spring<kUniform>(kzu, s.up[2], group);
    spring<kUniform>(inverse, s.inverse, group);
    Float8 r = kxd * (x_down - at.own) + kxu * (x_up - at.own) + kyd * (at.y_down - at.own) +
               kyu * (at.y_up - at.own) + kzd * (at.z_down - at.own) + kzu * (at.z_up - at.own);
    if (row.load[axis] != nullptr) {
      Float8 force;
      load(force, row.load[axis] + group * kLanes);
      r += force;
    }
    if (row.hold[axis] != nullptr) {
      Float8 hold, prolonged;
      load(hold, row.hold[axis] + group * kLanes);
      load(prolonged, row.held_at[axis] + group * kLanes);
      const Float8 safe = inverse == 0.0F ? Float8{} + 1.0F : inverse;
      r += row.hold_times * hold / safe * (prolonged - at.own);
    }
    Mask8 stays;
    staying(stays, row, inverse, axis, group);
    r = stays ? Float8{} : r;
    if constexpr (clamps(kLimits)) {
      Mask8 beyond{};
      note_beyond<kUniform>(beyond, at.own, x_down, x_up, at, s, band, group);
      if (any(beyond)) {
        Interval in;
        everywhere(in);
        narrow_beside<kUniform, kLimits>(in, at, s, bounds, group);
        narrow<kUniform, kLimits>(in, x_up, x_down, s, bounds, 0, group);
        const Mask8 resisted =
            ((r > 0.0F) & (at.own >= in.high - tight)) | ((r < 0.0F) & (at.own <= in.low + tight));
        r = resisted ? Float8{} : r;
        result.resisted[axis] |= lanes_set(resisted) << (group * kLanes);
      }
    }
    store(out + group * kLanes, r);
    take_largest_size(most_N, r);
    take_largest_size(most_m, r * inverse);
  }
}

template <bool kUniform, Limits kLimits>
HYBRID_INLINE void residual_axes(RowResidual& result, const LevelRow& row, const RowLimits* limits,
                                 float tight, LaneSpan span, RowVector& out) {
  Float8 most_N{}, most_m{};
#pragma GCC unroll 1
  for (std::size_t axis = 0; axis < 3; ++axis) {
    residual_axis<kUniform, kLimits>(result, row, bounds_of(limits, axis), axis, tight, span,
                                     out[axis].data(), most_N, most_m);
  }
  result.most_N = largest(most_N);
  result.most_way_m = largest(most_m);
}

// bits of all lanes combined
HYBRID_INLINE std::uint32_t all_bits(const Mask8& bits) {
  const Mask8 half = bits | __builtin_shufflevector(bits, bits, 4, 5, 6, 7, 0, 1, 2, 3);
  const Mask8 pair = half | __builtin_shufflevector(half, half, 2, 3, 0, 1, 2, 3, 0, 1);
  return static_cast<std::uint32_t>(pair[0] | pair[1]);
}

template <bool kUniform, Limits kLimits>
HYBRID_INLINE void look_at_limits(const LevelRow& row, const AxisBounds& bounds, std::size_t axis,
                                  const std::array<float, 3>& tight, LinksAtLimits& out) {
  const AxisSprings s(row.springs, axis);
  const float* own = row.u[axis];
  Span u;
  ends_of(u, own, row.x, {});
#pragma GCC unroll 1
  for (int group = 0; group < kLaneGroups; ++group)
    load(u.at[static_cast<std::size_t>(group) + 1], own + group * kLanes);
  // Each lane sets its own bit: cheaper than gathering lanes in each Float8.
  Mask8 bit{1, 2, 4, 8, 16, 32, 64, 128};
  std::array<Mask8, 3> at_low{}, at_high{}, down_at_low{}, down_at_high{};
  Mask8 pulled_up{}, pulled_down{}, movable{};
#pragma GCC unroll 1
  for (int group = 0; group < kLaneGroups; ++group, bit <<= kLanes) {
    const auto n = static_cast<std::size_t>(group);
    const int lane = group * kLanes;
    Around at;
    look_around(at, own + lane, row.z);
    Float8 x_down, x_up, k, inverse;
    shift_down(x_down, u.at[n], at.own);
    shift_up(x_up, at.own, u.at[n + 2]);
    const std::array<Float8, 3> up{x_up - at.own, at.y_up - at.own, at.z_up - at.own},
        down{at.own - x_down, at.own - at.y_down, at.own - at.z_down};
    Float8 pull{};
#pragma GCC unroll 3
    for (std::size_t d = 0; d < 3; ++d) {
      Float8 low = Float8{} + bounds.row.low[d], high = Float8{} + bounds.row.high[d];
      if constexpr (kLimits == Limits::lanes) {
        load(low, bounds.down_low[d] + lane);
        low *= bounds.sign[d];
        load(high, bounds.down_high[d] + lane);
      }
      spring<kUniform>(k, s.down[d], group);
      pull -= k * down[d];
      down_at_low[d] |= (k > 0.0F) & (down[d] <= low + tight[d]) & bit;
      down_at_high[d] |= (k > 0.0F) & (down[d] >= high - tight[d]) & bit;
      if constexpr (kLimits == Limits::lanes) {
        load(low, bounds.up_low[d] + lane);
        low *= bounds.sign[d];
        load(high, bounds.up_high[d] + lane);
      }
      spring<kUniform>(k, s.up[d], group);
      pull += k * up[d];
      at_low[d] |= (k > 0.0F) & (up[d] <= low + tight[d]) & bit;
      at_high[d] |= (k > 0.0F) & (up[d] >= high - tight[d]) & bit;
    }
    if (row.load[axis] != nullptr) {
      load(k, row.load[axis] + lane);
      pull += k;
    }
    spring<kUniform>(inverse, s.inverse, group);
    movable |= (inverse != 0.0F) & bit;
    pulled_up |= (pull > 0.0F) & bit;
    pulled_down |= (pull < 0.0F) & bit;
    store(out.pull_N.data() + lane, pull);
  }
  for (std::size_t d = 0; d < 3; ++d) {
    out.at_low[d] = all_bits(at_low[d]);
    out.at_high[d] = all_bits(at_high[d]);
    out.down_at_low[d] = all_bits(down_at_low[d]);
    out.down_at_high[d] = all_bits(down_at_high[d]);
  }
  out.movable = all_bits(movable);
  out.pulled_up = all_bits(pulled_up);
  out.pulled_down = all_bits(pulled_down);
}

}  // namespace

HYBRID_MULTIVERSIONED_512 void links_at_limits(const LevelRow& row, const RowLimits& limits, std::size_t axis,
                                               const std::array<float, 3>& tight_m,
                                               LinksAtLimits& out) noexcept {
  const AxisBounds bounds(limits, axis);
  if (limits.lanes != nullptr) {
    look_at_limits<false, Limits::lanes>(row, bounds, axis, tight_m, out);
  } else {
    row.springs.uniform ? look_at_limits<true, Limits::row>(row, bounds, axis, tight_m, out)
                        : look_at_limits<false, Limits::row>(row, bounds, axis, tight_m, out);
  }
}

HYBRID_MULTIVERSIONED_512 RowResidual residual_row(const LevelRow& row, const RowLimits* limits,
                                                   float tight_m, LaneSpan span, RowVector& out) noexcept {
  RowResidual result;
  const bool uniform = row.springs.uniform;
  if (limits == nullptr) {
    uniform ? residual_axes<true, Limits::none>(result, row, limits, tight_m, span, out)
            : residual_axes<false, Limits::none>(result, row, limits, tight_m, span, out);
  } else if (limits->lanes != nullptr) {
    residual_axes<false, Limits::lanes>(result, row, limits, tight_m, span, out);
  } else {
    uniform ? residual_axes<true, Limits::row>(result, row, limits, tight_m, span, out)
            : residual_axes<false, Limits::row>(result, row, limits, tight_m, span, out);
  }
  return result;
}

HYBRID_MULTIVERSIONED_512 void measure_row(const RowStiffness& springs, const RowVector& residual,
                                           LaneSpan span, RowResidual& out) noexcept {
  Float8 most_N{}, most_m{};
#pragma GCC unroll 1
  for (std::size_t axis = 0; axis < 3; ++axis) {
#pragma GCC unroll 1
    for (int group = span.first; group <= span.last; ++group) {
      Float8 r, inverse;
      load(r, residual[axis].data() + group * kLanes);
      load(inverse, springs.inverse + axis * kRow + group * kLanes);
      take_largest_size(most_N, r);
      take_largest_size(most_m, r * inverse);
    }
  }
  out.most_N = largest(most_N);
  out.most_way_m = largest(most_m);
}

}  // namespace voxel
