// SPDX-License-Identifier: GPL-3.0-or-later
// Inside of the row passes: what links allow, and whether it has to be looked at.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>

#include "voxel/multigrid/row_stencil.h"

namespace voxel {

constexpr float kFar = std::numeric_limits<float>::max();

// What links allow a voxel.
struct Interval {
  Float8 low, high;
};
HYBRID_INLINE void everywhere(Interval& in) {
  in.low = Float8{} - kFar;
  in.high = Float8{} + kFar;
}
// … the link to the neighbour above, which stands at `to`, and the one to the neighbour below.
// None; one set for the row; each lane its own.
enum class Limits : std::uint8_t { none, row, lanes };
constexpr bool clamps(Limits l) {
  return l != Limits::none;
}

// Limits of one axis of a row: `low[d]` and `high[d]` of the links up and down, where each lane has its own.
struct AxisBounds {
  AxisLimits row;
  std::array<const float*, 3> up_low{}, up_high{}, down_low{}, down_high{};
  std::array<float, 3> sign{};  // of low: across, the limit below is the one above, negative

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

// … the link to the neighbour above, which stands at `to`, and the one to the neighbour below.
template <bool kUniform, Limits kLimits>
HYBRID_INLINE void narrow(Interval& in, const Float8& up, const Float8& down, const AxisSprings& s,
                          const AxisBounds& b, std::size_t d, int octet) {
  if constexpr (kLimits == Limits::lanes) {
    Float8 low, high;
    load(low, b.up_low[d] + octet * kLanes);
    load(high, b.up_high[d] + octet * kLanes);
    low *= b.sign[d];
    take_largest(in.low, up - high);
    take_least(in.high, up - low);
    load(low, b.down_low[d] + octet * kLanes);
    load(high, b.down_high[d] + octet * kLanes);
    low *= b.sign[d];
    take_largest(in.low, down + low);
    take_least(in.high, down + high);
  } else {
    Float8 above_low = up - b.row.high[d], above_high = up - b.row.low[d];
    Float8 below_low = down + b.row.low[d], below_high = down + b.row.high[d];
    if (!kUniform) {
      Float8 k;
      load(k, s.up[d] + octet * kLanes);
      above_low = k > 0.0F ? above_low : in.low;
      above_high = k > 0.0F ? above_high : in.high;
      load(k, s.down[d] + octet * kLanes);
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
                                 int octet) {
  narrow<kUniform, kLimits>(in, at.y_up, at.y_down, s, b, 1, octet);
  narrow<kUniform, kLimits>(in, at.z_up, at.z_down, s, b, 2, octet);
}
// An empty interval can only be a rounding wide: it stays where it is then.
HYBRID_INLINE void bring_into(Float8& wanted, const Interval& in, const Float8& now) {
  take_largest(wanted, in.low);
  take_least(wanted, in.high);
  wanted = in.low > in.high ? now : wanted;
}
// The most by which links may differ before they have to be looked at, [d] of an axis: a little less than
// what the tightest of them allows.
struct Band {
  std::array<float, 3> most;

  explicit Band(const AxisLimits& l, float tight = 0.0F) {
    constexpr float kNear = 0.999F;
    for (std::size_t d = 0; d < 3; ++d) {
      const float least = std::min(l.high[d], -l.low[d]);
      most[d] = std::min(kNear * least, least - tight);
    }
  }
};
// Is a link of the octet beyond the band, when its own values are `own`?
template <bool kUniform>
HYBRID_INLINE void note_beyond(Mask8& beyond, const Float8& own, const Float8& x_down, const Float8& x_up,
                               const Around& at, const AxisSprings& s, const Band& band, int octet) {
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
      load(k, s.up[d] + octet * kLanes);
      out = (above >= band.most[d]) & (k > 0.0F);
      load(k, s.down[d] + octet * kLanes);
      out |= (below >= band.most[d]) & (k > 0.0F);
    }
    beyond |= out;
  }
}
// Where a row has no limits, what is said of them is not looked at.
HYBRID_INLINE AxisBounds bounds_of(const RowLimits* limits, std::size_t axis) {
  static constexpr std::array<AxisLimits, 3> kNone{};
  return limits != nullptr ? AxisBounds(*limits, axis) : AxisBounds(RowLimits{&kNone, nullptr}, axis);
}

template <bool kUniform>
HYBRID_INLINE void look_beyond(Mask8& beyond, const Float8& own, const Float8& x_down, const Float8& x_up,
                               const LevelRow& row, const Band& band, std::size_t axis, int octet) {
  const float* at = row.u[axis] + octet * kLanes;
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
      spring_up<false>(k, row.springs, axis, d, octet);
      beyond |= (up >= band.most[d]) & (k > 0.0F);
      spring_down<false>(k, row.springs, axis, d, octet);
      beyond |= (down >= band.most[d]) & (k > 0.0F);
    }
  }
}

// The same where each lane has limits of its own.
HYBRID_INLINE void look_beyond_lanes(Mask8& beyond, const Float8& own, const Float8& x_down,
                                     const Float8& x_up, const LevelRow& row, const RowLimits::Written& w,
                                     std::size_t axis, int octet) {
  constexpr float kNear = 0.999F;
  const float* at = row.u[axis] + octet * kLanes;
  const auto lanes = static_cast<std::size_t>(octet) * kLanes;
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

// How a row's links are looked at: by the tightest limits, neighbours that are not there taken for neighbours
// at rest, so that no spring is read; by the same, only where there is a link; each by its own.
enum class Beyond : std::uint8_t { tightest, linked, lanes };

// True when any octet has such a link.
template <Beyond kBeyond>
HYBRID_INLINE bool look_at_axes(std::array<Mask8, 3>& beyond, const Axes& u, const LevelRow& row,
                                const RowLimits& limits, const std::array<Band, 3>& band, LaneSpan span) {
  beyond = {};
#pragma GCC unroll 1
  for (int octet = span.first; octet <= span.last; ++octet) {
    const auto n = static_cast<std::size_t>(octet - span.first);
#pragma GCC unroll 3
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Float8 x_down, x_up;
      shift_down(x_down, u[axis][n], u[axis][n + 1]);
      shift_up(x_up, u[axis][n + 1], u[axis][n + 2]);
      if constexpr (kBeyond == Beyond::lanes) {
        look_beyond_lanes(beyond[axis], u[axis][n + 1], x_down, x_up, row, *limits.lanes, axis, octet);
      } else {
        look_beyond<kBeyond == Beyond::tightest>(beyond[axis], u[axis][n + 1], x_down, x_up, row, band[axis],
                                                 axis, octet);
      }
    }
  }
  const Mask8 all = beyond[0] | beyond[1] | beyond[2];
  return any(all);
}

// Which axes may have links beyond the band, bit by bit, if the row stood at `u`. Most rows have none, and
// each look costs more than the one before it.
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
