// SPDX-License-Identifier: GPL-3.0-or-later
// Internal to the row passes: the interval that links allow, and tests whether limits have to be applied.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>

#include "voxel/multigrid/row_stencil.h"

namespace voxel {

constexpr float kFar = std::numeric_limits<float>::max();

// Interval that links allow a voxel.
struct Interval {
  Float8 low, high;
};
HYBRID_INLINE void everywhere(Interval& in) {
  in.low = Float8{} - kFar;
  in.high = Float8{} + kFar;
}
// Limits of a row: none, one set for the row, or one for each lane.
enum class Limits : std::uint8_t { none, row, lanes };
constexpr bool clamps(Limits l) {
  return l != Limits::none;
}

// Limits of one axis of a row. If each lane has its own, the arrays hold them by d for the links up and down.
struct AxisBounds {
  AxisLimits row;
  std::array<const float*, 3> up_low{}, up_high{}, down_low{}, down_high{};
  std::array<float, 3> sign{};  // factor of …_low: −1 across, where it holds the upper limit

  AxisBounds(const RowLimits& limits, std::size_t axis) : row((*limits.of)[axis]) {
    if (limits.lanes == nullptr) return;
    const RowLimits::Written& w = *limits.lanes;
    for (std::size_t d = 0; d < 3; ++d) {
      const bool along = d == axis;
      up_low[d] = (along ? w.up_low : w.up_across)[d].data();
      up_high[d] = (along ? w.up_high : w.up_across)[d].data();
      down_low[d] = (along ? w.down_low : w.down_across)[d].data();
      down_high[d] = (along ? w.down_high : w.down_across)[d].data();
      sign[d] = along ? 1.0F : -1.0F;
    }
  }
};

// Intersects an interval with the limits of the links along d to the neighbours at `up` and `down`.
template <bool kUniform, Limits kLimits>
HYBRID_INLINE void narrow(Interval& in, const Float8& up, const Float8& down, const AxisSprings& s,
                          const AxisBounds& b, std::size_t d, int group) {
  if constexpr (kLimits == Limits::lanes) {
    Float8 low, high;
    load(low, b.up_low[d] + group * kLanes);
    load(high, b.up_high[d] + group * kLanes);
    low *= b.sign[d];
    take_largest(in.low, up - high);
    take_least(in.high, up - low);
    load(low, b.down_low[d] + group * kLanes);
    load(high, b.down_high[d] + group * kLanes);
    low *= b.sign[d];
    take_largest(in.low, down + low);
    take_least(in.high, down + high);
  } else {
    Float8 above_low = up - b.row.high[d], above_high = up - b.row.low[d];
    Float8 below_low = down + b.row.low[d], below_high = down + b.row.high[d];
    if (!kUniform) {
      Float8 k;
      load(k, s.up[d] + group * kLanes);
      above_low = k > 0.0F ? above_low : in.low;
      above_high = k > 0.0F ? above_high : in.high;
      load(k, s.down[d] + group * kLanes);
      below_low = k > 0.0F ? below_low : in.low;
      below_high = k > 0.0F ? below_high : in.high;
    }
    take_largest(in.low, above_low);
    take_least(in.high, above_high);
    take_largest(in.low, below_low);
    take_least(in.high, below_high);
  }
}
template <bool kUniform, Limits kLimits>
HYBRID_INLINE void narrow_beside(Interval& in, const Around& at, const AxisSprings& s, const AxisBounds& b,
                                 int group) {
  narrow<kUniform, kLimits>(in, at.y_up, at.y_down, s, b, 1, group);
  narrow<kUniform, kLimits>(in, at.z_up, at.z_down, s, b, 2, group);
}
// Clamps `wanted` to an interval. An interval can only be empty by rounding. Then the voxel stays where it
// is.
HYBRID_INLINE void bring_into(Float8& wanted, const Interval& in, const Float8& now) {
  take_largest(wanted, in.low);
  take_least(wanted, in.high);
  wanted = in.low > in.high ? now : wanted;
}
// [d] A link along d needs no check against its own limits if the difference of its ends is smaller in size
// than this (m). It is a little less than the tightest limit in the row.
struct Band {
  std::array<float, 3> most;

  explicit Band(const AxisLimits& l, float tight = 0.0F) {
    constexpr float kNear = 0.999F;  // of the limit; allows for rounding
    for (std::size_t d = 0; d < 3; ++d) {
      const float least = std::min(l.high[d], -l.low[d]);
      most[d] = std::min(kNear * least, least - tight);
    }
  }
};
// Marks lanes that would have a link beyond the band if the Float8 stood at `own`.
template <bool kUniform>
HYBRID_INLINE void note_beyond(Mask8& beyond, const Float8& own, const Float8& x_down, const Float8& x_up,
                               const Around& at, const AxisSprings& s, const Band& band, int group) {
  const std::array<Float8, 3> up{x_up - own, at.y_up - own, at.z_up - own},
      down{own - x_down, own - at.y_down, own - at.z_down};
  for (std::size_t d = 0; d < 3; ++d) {
    Mask8 out;
    if (kUniform) {
      Float8 most{};
      take_largest_size(most, up[d]);
      take_largest_size(most, down[d]);
      out = most >= band.most[d];
    } else {
      Float8 above{}, below{}, k;
      take_largest_size(above, up[d]);
      take_largest_size(below, down[d]);
      load(k, s.up[d] + group * kLanes);
      out = (above >= band.most[d]) & (k > 0.0F);
      load(k, s.down[d] + group * kLanes);
      out |= (below >= band.most[d]) & (k > 0.0F);
    }
    beyond |= out;
  }
}
// A row without limits gets limits that are never read.
HYBRID_INLINE AxisBounds bounds_of(const RowLimits* limits, std::size_t axis) {
  static constexpr std::array<AxisLimits, 3> kNone{};
  return limits != nullptr ? AxisBounds(*limits, axis) : AxisBounds(RowLimits{&kNone, nullptr}, axis);
}

template <bool kUniform>
HYBRID_INLINE void look_beyond(Mask8& beyond, const Float8& own, const Float8& x_down, const Float8& x_up,
                               const LevelRow& row, const Band& band, std::size_t axis, int group) {
  const float* at = row.u[axis] + group * kLanes;
  for (std::size_t d = 0; d < 3; ++d) {
    Float8 above = x_up, below = x_down;
    if (d > 0) {
      load(above, at + (d == 1 ? kRow : row.z));
      load(below, at - (d == 1 ? kRow : row.z));
    }
    Float8 up{}, down{};
    take_largest_size(up, above - own);
    take_largest_size(down, own - below);
    if (kUniform) {
      take_largest(up, down);
      beyond |= up >= band.most[d];
    } else {
      Float8 k;
      spring_up<false>(k, row.springs, axis, d, group);
      beyond |= (up >= band.most[d]) & (k > 0.0F);
      spring_down<false>(k, row.springs, axis, d, group);
      beyond |= (down >= band.most[d]) & (k > 0.0F);
    }
  }
}

// look_beyond() for lanes with limits of their own.
HYBRID_INLINE void look_beyond_lanes(Mask8& beyond, const Float8& own, const Float8& x_down,
                                     const Float8& x_up, const LevelRow& row, const RowLimits::Written& w,
                                     std::size_t axis, int group) {
  constexpr float kNear = 0.999F;  // of the limit; allows for rounding
  const float* at = row.u[axis] + group * kLanes;
  const auto lanes = static_cast<std::size_t>(group) * kLanes;
  for (std::size_t d = 0; d < 3; ++d) {
    Float8 above = x_up, below = x_down, low, high;
    if (d > 0) {
      load(above, at + (d == 1 ? kRow : row.z));
      load(below, at - (d == 1 ? kRow : row.z));
    }
    const bool along = d == axis;
    load(low, (along ? w.up_low : w.up_across)[d].data() + lanes);
    load(high, (along ? w.up_high : w.up_across)[d].data() + lanes);
    low = along ? low : -low;
    beyond |= (above - own >= kNear * high) | (above - own <= kNear * low);
    load(low, (along ? w.down_low : w.down_across)[d].data() + lanes);
    load(high, (along ? w.down_high : w.down_across)[d].data() + lanes);
    low = along ? low : -low;
    beyond |= (own - below >= kNear * high) | (own - below <= kNear * low);
  }
}

// Comparison of links with limits. `tightest`: all links, with the tightest limits; missing neighbours count
// as neighbours at rest, so that no spring is read. `linked`: existing links, with the tightest limits.
// `lanes`: each link, with its own limits.
enum class Beyond : std::uint8_t { tightest, linked, lanes };

// Marks the lanes that have a link beyond these limits, by axis. True if there is any.
template <Beyond kBeyond>
HYBRID_INLINE bool look_at_axes(std::array<Mask8, 3>& beyond, const Axes& u, const LevelRow& row,
                                const RowLimits& limits, const std::array<Band, 3>& band, LaneSpan span) {
  beyond = {};
#pragma GCC unroll 1
  for (int group = span.first; group <= span.last; ++group) {
    const auto n = static_cast<std::size_t>(group - span.first);
#pragma GCC unroll 3
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Float8 x_down, x_up;
      shift_down(x_down, u[axis][n], u[axis][n + 1]);
      shift_up(x_up, u[axis][n + 1], u[axis][n + 2]);
      if constexpr (kBeyond == Beyond::lanes) {
        look_beyond_lanes(beyond[axis], u[axis][n + 1], x_down, x_up, row, *limits.lanes, axis, group);
      } else {
        look_beyond<kBeyond == Beyond::tightest>(beyond[axis], u[axis][n + 1], x_down, x_up, row, band[axis],
                                                 axis, group);
      }
    }
  }
  const Mask8 all = beyond[0] | beyond[1] | beyond[2];
  return any(all);
}

// Bits of the axes that may have links beyond the band if the row stood at `u`. Cheap tests come first,
// because most rows have no such link.
template <bool kUniform>
HYBRID_INLINE unsigned beyond_band(const Axes& u, const LevelRow& row, const RowLimits& limits, LaneSpan span,
                                   float tight) {
  std::array<Mask8, 3> beyond{};
  const std::array<Band, 3> band{Band((*limits.of)[0], tight), Band((*limits.of)[1], tight),
                                 Band((*limits.of)[2], tight)};
  if (!look_at_axes<Beyond::tightest>(beyond, u, row, limits, band, span)) return 0;
  if constexpr (!kUniform) {
    if (!look_at_axes<Beyond::linked>(beyond, u, row, limits, band, span)) return 0;
    if (limits.lanes != nullptr && !look_at_axes<Beyond::lanes>(beyond, u, row, limits, band, span)) return 0;
  }
  unsigned out = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) out |= any(beyond[axis]) ? 1U << axis : 0U;
  return out;
}

}  // namespace voxel
