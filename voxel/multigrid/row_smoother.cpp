// SPDX-License-Identifier: GPL-3.0-or-later
// Smoothing and correction of a row.
#include "voxel/multigrid/row_smoother.h"

#include <cstring>

#include "voxel/lattice/simd_dispatch.h"
#include "voxel/multigrid/row_limits.h"
#include "voxel/multigrid/row_stencil.h"

namespace voxel {
namespace {

// Smooths one axis of a row of voxels near its limits. (Cells have no limits.)
template <bool kUniform, Limits kLimits>
HYBRID_INLINE void smooth_axis(const LevelRow& row, const AxisBounds& bounds, std::size_t axis, LaneSpan span,
                               Float8& most) {
  const AxisSprings s(row.springs, axis);
  float* own = row.u[axis];
  Span u;
  std::array<Float8, kLaneGroups> beside;
  std::array<Mask8, kLaneGroups> stays;
  std::array<Interval, kLaneGroups> allowed;
  ends_of(u, own, row.x, span);
  const int count = span.last - span.first + 1;
#pragma GCC unroll 1
  for (int n = 0; n < count; ++n) {
    const int group = span.first + n;
    const auto un = static_cast<std::size_t>(n);
    Around at;
    look_around(at, own + group * kLanes, row.z);
    u.at[un + 1] = at.own;
    Float8 kyd, kyu, kzd, kzu, inverse;
    spring<kUniform>(kyd, s.down[1], group);
    spring<kUniform>(kyu, s.up[1], group);
    spring<kUniform>(kzd, s.down[2], group);
    spring<kUniform>(kzu, s.up[2], group);
    spring<kUniform>(inverse, s.inverse, group);
    Float8 sum = kyd * at.y_down + kyu * at.y_up + kzd * at.z_down + kzu * at.z_up;
    if (row.load[axis] != nullptr) {
      Float8 force;
      load(force, row.load[axis] + group * kLanes);
      sum += force;
    }
    beside[un] = sum;
    staying(stays[un], row, inverse, axis, group);
    everywhere(allowed[un]);
    narrow_beside<kUniform, kLimits>(allowed[un], at, s, bounds, group);
  }
#pragma GCC unroll 1
  for (int colour = 0; colour < 2; ++colour) {
#pragma GCC unroll 1
    for (int n = 0; n < count; ++n) {
      const int group = span.first + n;
      const auto un = static_cast<std::size_t>(n);
      const Float8 now = u.at[un + 1];
      Float8 x_down, x_up, kxd, kxu, inverse;
      shift_down(x_down, u.at[un], now);
      shift_up(x_up, now, u.at[un + 2]);
      spring<kUniform>(kxd, s.down[0], group);
      spring<kUniform>(kxu, s.up[0], group);
      spring<kUniform>(inverse, s.inverse, group);
      Float8 wanted = (kxd * x_down + kxu * x_up + beside[un]) * inverse;
      Interval in = allowed[un];
      narrow<kUniform, kLimits>(in, x_up, x_down, s, bounds, 0, group);
      bring_into(wanted, in, now);
      const Mask8 taken = (colour == 0 ? kEven : ~kEven) & ~stays[un];
      select(u.at[un + 1], taken, wanted, now);
    }
  }
#pragma GCC unroll 1
  for (int n = 0; n < count; ++n) {
    float* to = own + (span.first + n) * kLanes;
    Float8 before;
    load(before, to);
    take_largest_size(most, u.at[static_cast<std::size_t>(n) + 1] - before);
    store(to, u.at[static_cast<std::size_t>(n) + 1]);
  }
}

// Smooths the axes that stay clear of limits; returns the bits of the others, which are left as they were.
template <bool kUniform, bool kLook>
HYBRID_INLINE unsigned smooth_freely(const LevelRow& row, const RowLimits* limits, LaneSpan span,
                                     Float8& most) {
  const RowStiffness& s = row.springs;
  Axes u, beside;
  std::array<std::array<Mask8, kLaneGroups>, 3> stays;
  load_axes(u, row, span);
#pragma GCC unroll 1
  for (int group = span.first; group <= span.last; ++group) {
    const auto n = static_cast<std::size_t>(group - span.first);
#pragma GCC unroll 3
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float* own = row.u[axis] + group * kLanes;
      Float8 k, value, sum;
      spring_down<kUniform>(k, s, axis, 1, group);
      load(value, own - kRow);
      sum = k * value;
      spring_up<kUniform>(k, s, axis, 1, group);
      load(value, own + kRow);
      sum += k * value;
      spring_down<kUniform>(k, s, axis, 2, group);
      load(value, own - row.z);
      sum += k * value;
      spring_up<kUniform>(k, s, axis, 2, group);
      load(value, own + row.z);
      sum += k * value;
      if (row.load[axis] != nullptr) {
        load(value, row.load[axis] + group * kLanes);
        sum += value;
      }
      beside[axis][n] = sum;
      inverse_of<kUniform>(k, s, axis, group);
      staying(stays[axis][n], row, k, axis, group);
    }
  }
#pragma GCC unroll 1
  for (int colour = 0; colour < 2; ++colour) {
    const Mask8 own_colour = colour == 0 ? kEven : ~kEven;
#pragma GCC unroll 1
    for (int group = span.first; group <= span.last; ++group) {
      const auto n = static_cast<std::size_t>(group - span.first);
#pragma GCC unroll 3
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const Float8 now = u[axis][n + 1];
        Float8 x_down, x_up, kxd, kxu, inverse;
        shift_down(x_down, u[axis][n], now);
        shift_up(x_up, now, u[axis][n + 2]);
        spring_down<kUniform>(kxd, s, axis, 0, group);
        spring_up<kUniform>(kxu, s, axis, 0, group);
        inverse_of<kUniform>(inverse, s, axis, group);
        Float8 wanted = (kxd * x_down + kxu * x_up + beside[axis][n]) * inverse;
        if (row.hold[axis] != nullptr) {
          Float8 prolonged, hold;
          load(prolonged, row.held_at[axis] + group * kLanes);
          load(hold, row.hold[axis] + group * kLanes);
          hold *= row.hold_times;
          wanted += (prolonged - wanted) * (hold / (1.0F + hold));
        }
        select(u[axis][n + 1], own_colour & ~stays[axis][n], wanted, now);
      }
    }
  }
  unsigned beyond = 0;
  if constexpr (kLook) beyond = beyond_band<kUniform>(u, row, *limits, span, 0.0F);
#pragma GCC unroll 1
  for (int group = span.first; group <= span.last; ++group) {
    const auto n = static_cast<std::size_t>(group - span.first);
#pragma GCC unroll 3
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (kLook && (beyond >> axis & 1U) != 0) continue;
      float* to = row.u[axis] + group * kLanes;
      Float8 before;
      load(before, to);
      take_largest_size(most, u[axis][n + 1] - before);
      store(to, u[axis][n + 1]);
    }
  }
  return beyond;
}

// Smooths all axes without limits first. Axes that come near a limit are then smoothed again with limits.
template <bool kUniform, Limits kLimits>
HYBRID_INLINE float smooth_axes(const LevelRow& row, const RowLimits* limits, LaneSpan span) {
  Float8 most{};
  const unsigned beyond = smooth_freely<kUniform, clamps(kLimits)>(row, limits, span, most);
  if constexpr (clamps(kLimits)) {
#pragma GCC unroll 1
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if ((beyond >> axis & 1U) == 0) continue;
      const AxisBounds bounds = bounds_of(limits, axis);
      smooth_axis<kUniform, kLimits>(row, bounds, axis, span, most);
    }
  }
  return largest(most);
}

template <bool kUniform, Limits kLimits>
HYBRID_INLINE void correct_axis(const LevelRow& row, const AxisBounds& bounds, std::size_t axis,
                                LaneSpan span, const float* correction, float* refused, Float8& most) {
  const AxisSprings s(row.springs, axis);
  float* own = row.u[axis];
  const int count = span.last - span.first + 1;
  Span u;
  std::array<Float8, kLaneGroups> target;
  std::array<Mask8, kLaneGroups> stays;
  ends_of(u, own, row.x, span);
#pragma GCC unroll 1
  for (int n = 0; n < count; ++n) {
    const int group = span.first + n;
    const auto un = static_cast<std::size_t>(n);
    Float8 now, way, inverse;
    load(now, own + group * kLanes);
    load(way, correction + group * kLanes);
    spring<kUniform>(inverse, s.inverse, group);
    staying(stays[un], row, inverse, axis, group);
    take_largest_size(most, way);
    target[un] = stays[un] ? now : now + way;
    u.at[un + 1] = now;
  }
  std::array<Interval, kLaneGroups> allowed;
#pragma GCC unroll 1
  for (int n = 0; n < count; ++n) {
    const int group = span.first + n;
    Around at;
    look_around(at, own + group * kLanes, row.z);
    everywhere(allowed[static_cast<std::size_t>(n)]);
    narrow_beside<kUniform, kLimits>(allowed[static_cast<std::size_t>(n)], at, s, bounds, group);
  }
  // Every second voxel moves at a time. With its neighbours fixed, a voxel's limits are an interval.
#pragma GCC unroll 1
  for (int colour = 0; colour < 2; ++colour) {
#pragma GCC unroll 1
    for (int n = 0; n < count; ++n) {
      const int group = span.first + n;
      const auto un = static_cast<std::size_t>(n);
      const Float8 now = u.at[un + 1];
      Float8 x_down, x_up, wanted = target[un];
      shift_down(x_down, u.at[un], now);
      shift_up(x_up, now, u.at[un + 2]);
      Interval in = allowed[un];
      narrow<kUniform, kLimits>(in, x_up, x_down, s, bounds, 0, group);
      bring_into(wanted, in, now);
      const Mask8 taken = (colour == 0 ? kEven : ~kEven) & ~stays[un];
      select(u.at[un + 1], taken, wanted, now);
    }
  }
#pragma GCC unroll 1
  for (int n = 0; n < count; ++n) {
    const int group = span.first + n;
    const auto un = static_cast<std::size_t>(n);
    Float8 now, way, inverse;
    load(now, own + group * kLanes);
    load(way, correction + group * kLanes);
    spring<kUniform>(inverse, s.inverse, group);
    Mask8 fixed;
    standing(fixed, row, inverse, group);
    const Float8 left = now + way - u.at[un + 1];
    store(refused + group * kLanes, fixed ? Float8{} : left);
    store(own + group * kLanes, u.at[un + 1]);
  }
}

// Sets `refused` to the part of a correction that stopped voxels refuse. Returns the bits of the axes that
// have any.
template <bool kUniform>
HYBRID_INLINE unsigned note_stopped(const LevelRow& row, LaneSpan span, const RowVector& correction,
                                    RowVector& refused) {
  unsigned refusing = 0;
#pragma GCC unroll 1
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Mask8 some{};
#pragma GCC unroll 1
    for (int group = span.first; group <= span.last; ++group) {
      Float8 way, inverse;
      Mask8 fixed, stopped;
      load(way, correction[axis].data() + group * kLanes);
      inverse_of<kUniform>(inverse, row.springs, axis, group);
      standing(fixed, row, inverse, group);
      bits_set(stopped, row.stopped + group * kLanes, 1 << axis);
      way = (stopped & ~fixed) ? way : Float8{};
      some |= way != 0.0F;
      store(refused[axis].data() + group * kLanes, way);
    }
    if (any(some)) refusing |= 1U << axis;
  }
  return refusing;
}

// Corrects the axes that stay clear of limits; returns the bits of the others, which are left as they were.
template <bool kUniform, bool kLook>
HYBRID_INLINE unsigned correct_freely(const LevelRow& row, const RowLimits* limits, LaneSpan span,
                                      const RowVector& correction, RowVector& refused, unsigned& refusing,
                                      Float8& most) {
  Axes u;
  if (row.stopped != nullptr) refusing = note_stopped<kUniform>(row, span, correction, refused);
  if (kLook) {
    load_axes(u, row, span);
  }
#pragma GCC unroll 1
  for (int group = span.first; group <= span.last; ++group) {
    const auto n = static_cast<std::size_t>(group - span.first);
#pragma GCC unroll 3
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Float8 now, way;
      Mask8 stays;
      load(now, row.u[axis] + group * kLanes);
      load(way, correction[axis].data() + group * kLanes);
      standing_by_bits(stays, row, axis, group);
      if (row.stopped != nullptr) {
        Mask8 stopped;
        bits_set(stopped, row.stopped + group * kLanes, 1 << axis);
        stays |= stopped;
      }
      take_largest_size(most, way);
      u[axis][n + 1] = stays ? now : now + way;
    }
  }
  unsigned beyond = 0;
  if constexpr (kLook) beyond = beyond_band<kUniform>(u, row, *limits, span, 0.0F);
#pragma GCC unroll 1
  for (int group = span.first; group <= span.last; ++group) {
    const auto n = static_cast<std::size_t>(group - span.first);
#pragma GCC unroll 3
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!kLook || (beyond >> axis & 1U) == 0) store(row.u[axis] + group * kLanes, u[axis][n + 1]);
    }
  }
  return beyond;
}

template <bool kUniform, Limits kLimits>
HYBRID_INLINE RowCorrection correct_axes(const LevelRow& row, const RowLimits* limits, LaneSpan span,
                                         const RowVector& correction, RowVector& refused) {
  Float8 most{};
  unsigned refusing = 0;
  const unsigned beyond =
      correct_freely<kUniform, clamps(kLimits)>(row, limits, span, correction, refused, refusing, most);
  if constexpr (clamps(kLimits)) {
#pragma GCC unroll 1
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if ((beyond >> axis & 1U) == 0) continue;
      correct_axis<kUniform, kLimits>(row, bounds_of(limits, axis), axis, span, correction[axis].data(),
                                      refused[axis].data(), most);
    }
  }
  return {largest(most), refusing | beyond};
}

}  // namespace

HYBRID_MULTIVERSIONED_512 float smooth_row(const LevelRow& row, const RowLimits* limits,
                                           LaneSpan span) noexcept {
  const bool uniform = row.springs.uniform;
  if (limits == nullptr)
    return uniform ? smooth_axes<true, Limits::none>(row, limits, span)
                   : smooth_axes<false, Limits::none>(row, limits, span);
  if (limits->lanes != nullptr) return smooth_axes<false, Limits::lanes>(row, limits, span);
  return uniform ? smooth_axes<true, Limits::row>(row, limits, span)
                 : smooth_axes<false, Limits::row>(row, limits, span);
}

HYBRID_MULTIVERSIONED_512 RowCorrection correct_row(const LevelRow& row, const RowLimits* limits,
                                                    LaneSpan span, const RowVector& correction,
                                                    RowVector& refused) noexcept {
  if (limits == nullptr) return correct_axes<false, Limits::none>(row, limits, span, correction, refused);
  if (limits->lanes != nullptr)
    return correct_axes<false, Limits::lanes>(row, limits, span, correction, refused);
  return row.springs.uniform ? correct_axes<true, Limits::row>(row, limits, span, correction, refused)
                             : correct_axes<false, Limits::row>(row, limits, span, correction, refused);
}

}  // namespace voxel
