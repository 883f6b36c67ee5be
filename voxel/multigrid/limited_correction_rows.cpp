// SPDX-License-Identifier: GPL-3.0-or-later
// Inner loops of a limited correction on one row (limited_correction.h), in Float8, as in row_smoother.cpp.
#include "voxel/lattice/simd_dispatch.h"
#include "voxel/multigrid/row_limits.h"
#include "voxel/multigrid/row_smoother.h"
#include "voxel/multigrid/row_stencil.h"

namespace voxel {
namespace {

template <bool kUniform, Limits kLimits>
HYBRID_INLINE bool draw_back_axis(const LevelRow& row, const AxisBounds& bounds, std::size_t axis,
                                  const float* from) {
  constexpr float kRounding = 2.4e-7F;  // (unit: displacement) two of its last bits
  const AxisSprings s(row.springs, axis);
  float* own = row.u[axis];
  Span u;
  std::array<Interval, kLaneGroups> allowed;
  ends_of(u, own, row.x, {});
#pragma GCC unroll 1
  for (int group = 0; group < kLaneGroups; ++group) {
    const auto n = static_cast<std::size_t>(group);
    Around at;
    look_around(at, own + group * kLanes, row.z);
    u.at[n + 1] = at.own;
    everywhere(allowed[n]);
    narrow_beside<kUniform, kLimits>(allowed[n], at, s, bounds, group);
  }
  Mask8 came{};
#pragma GCC unroll 1
  for (int colour = 0; colour < 2; ++colour) {
#pragma GCC unroll 1
    for (int group = 0; group < kLaneGroups; ++group) {
      const auto n = static_cast<std::size_t>(group);
      const Float8 now = u.at[n + 1];
      Float8 x_down, x_up, home, rounding = -now;
      shift_down(x_down, u.at[n], now);
      shift_up(x_up, now, u.at[n + 2]);
      load(home, from + group * kLanes);
      Interval in = allowed[n];
      narrow<kUniform, kLimits>(in, x_up, x_down, s, bounds, 0, group);
      take_largest(rounding, now);
      rounding *= kRounding;
      const Mask8 taken = colour == 0 ? kEven : ~kEven;
      const Mask8 up = (now < in.low - rounding) & (home > now) & taken,
                  down = (now > in.high + rounding) & (home < now) & taken;
      take_least(in.low, home);
      take_largest(in.high, home);
      Float8 to = up ? in.low : now;
      to = down ? in.high : to;
      came |= to != now;
      u.at[n + 1] = to;
    }
  }
  if (!any(came)) return false;
#pragma GCC unroll 1
  for (int group = 0; group < kLaneGroups; ++group)
    store(own + group * kLanes, u.at[static_cast<std::size_t>(group) + 1]);
  return true;
}

template <bool kUniform, Limits kLimits>
HYBRID_INLINE bool draw_back_axes(const LevelRow& row, const RowLimits& limits, unsigned axes,
                                  const RowVector& from) {
  bool came = false;
#pragma GCC unroll 1
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if ((axes >> axis & 1U) != 0)
      came |= draw_back_axis<kUniform, kLimits>(row, AxisBounds(limits, axis), axis, from[axis].data());
  }
  return came;
}

HYBRID_INLINE void take_largest_step(Float8& most, const std::array<Float8, kLaneGroups + 2>& own,
                                     const float* beside) {
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kLaneGroups; ++n) {
    Float8 there;
    load(there, beside + n * kLanes);
    take_largest_size(most, own[n + 1] - there);
  }
}

// True if a link may be beyond the tightest limits. Missing neighbours count as neighbours at rest, so that
// no spring is read. Sets the lanes of `u` beyond both ends of the row.
HYBRID_INLINE bool steps_beyond(Axes& u, const LevelRow& row, const RowLimits& limits, unsigned sides) {
  Mask8 beyond{};
#pragma GCC unroll 1
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float* const own = row.u[axis];
    auto& at = u[axis];
    at[0] = Float8{} + ((sides & kXDown) != 0 ? own[kRow - 1 - row.x] : own[0]);
    at[kLaneGroups + 1] = Float8{} + ((sides & kXUp) != 0 ? own[row.x] : own[kRow - 1]);
    Float8 along_x{}, along_y{}, along_z{}, up;
    shift_up(up, at[kLaneGroups], at[kLaneGroups + 1]);
    take_largest_size(along_x, up - at[kLaneGroups]);
#pragma GCC unroll 4
    for (std::size_t n = 1; n <= kLaneGroups; ++n) {
      Float8 down;
      shift_down(down, at[n - 1], at[n]);
      take_largest_size(along_x, at[n] - down);
    }
    if ((sides & kYDown) != 0) take_largest_step(along_y, at, own - kRow);
    if ((sides & kYUp) != 0) take_largest_step(along_y, at, own + kRow);
    if ((sides & kZDown) != 0) take_largest_step(along_z, at, own - row.z);
    if ((sides & kZUp) != 0) take_largest_step(along_z, at, own + row.z);
    const Band band((*limits.of)[axis]);
    beyond |= (along_x >= band.most[0]) | (along_y >= band.most[1]) | (along_z >= band.most[2]);
  }
  return any(beyond);
}

}  // namespace

HYBRID_MULTIVERSIONED_512 SetOut set_out_row(const LevelRow& row, const RowLimits& limits, LaneSpan span,
                                             unsigned sides, RowVector& way, RowVector& refused) noexcept {
  SetOut out;
  Float8 most{};
  Mask8 cut{};
  Axes u;
#pragma GCC unroll 1
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Mask8 any_stopped{};
#pragma GCC unroll 1
    for (int group = 0; group < kLaneGroups; ++group) {
      float* const at = row.u[axis] + group * kLanes;
      float* const ways = way[axis].data() + group * kLanes;
      Float8 now, go;
      load(now, at);
      load(go, ways);
      store(ways, now);
      u[axis][static_cast<std::size_t>(group) + 1] = now;
      if (group < span.first || group > span.last) continue;
      Mask8 stands;
      standing_by_bits(stands, row, axis, group);
      cut |= stands & (go != 0.0F);
      go = stands ? Float8{} : go;
      take_largest_size(most, go);
      if (row.stopped != nullptr) {
        Mask8 stopped;
        bits_set(stopped, row.stopped + group * kLanes, 1 << axis);
        any_stopped |= stopped & (go != 0.0F);
        store(refused[axis].data() + group * kLanes, stopped ? go : Float8{});
        go = stopped ? Float8{} : go;
      }
      now += go;
      store(at, now);
      u[axis][static_cast<std::size_t>(group) + 1] = now;
    }
    if (any(any_stopped)) out.stopped |= 1U << axis;
  }
  out.most_m = largest(most);
  out.cut = any(cut);
  out.beyond = steps_beyond(u, row, limits, sides);
  return out;
}

HYBRID_MULTIVERSIONED_512 bool may_be_beyond(const LevelRow& row, const RowLimits& limits,
                                             unsigned sides) noexcept {
  Axes u;
  load_axes(u, row, {});
  return steps_beyond(u, row, limits, sides);
}

HYBRID_MULTIVERSIONED_512 unsigned axes_beyond(const LevelRow& row, const RowLimits& limits) noexcept {
  Axes u;
  load_axes(u, row, {});
  return row.springs.uniform && limits.lanes == nullptr ? beyond_band<true>(u, row, limits, {}, 0.0F)
                                                        : beyond_band<false>(u, row, limits, {}, 0.0F);
}

HYBRID_MULTIVERSIONED_512 bool draw_back_row(const LevelRow& row, const RowLimits& limits, unsigned axes,
                                             const RowVector& from) noexcept {
  if (limits.lanes != nullptr) return draw_back_axes<false, Limits::lanes>(row, limits, axes, from);
  return row.springs.uniform ? draw_back_axes<true, Limits::row>(row, limits, axes, from)
                             : draw_back_axes<false, Limits::row>(row, limits, axes, from);
}

}  // namespace voxel
