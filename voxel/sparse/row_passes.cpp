// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/sparse/row_passes.h"

#include <algorithm>
#include <cstring>
#include <limits>

#include "voxel/wide.h"

namespace voxel::sparse {
namespace {

constexpr float kFar = std::numeric_limits<float>::max();
constexpr OctetMask kEven{-1, 0, -1, 0, -1, 0, -1, 0};

// The springs of one axis of a row: lanes apart, or (kUniform) one for all.
struct AxisSprings {
  std::array<const float*, 3> up, down;
  const float* inverse;

  AxisSprings(const RowCouplings& s, std::size_t axis) : inverse(s.inverse + axis * kRow) {
    for (std::size_t d = 0; d < 3; ++d) {
      up[d] = (d == axis ? s.up_along : s.up_across) + d * kRow;
      down[d] = (d == axis ? s.down_along : s.down_across) + d * kRow;
    }
  }
};
template <bool kUniform>
HYBRID_INLINE void spring(Octet& k, const float* lanes, int octet) {
  load(k, kUniform ? lanes : lanes + octet * kOctet);
}

// An octet of a row, and what stands around it.
struct Around {
  Octet own, y_down, y_up, z_down, z_up;
};
HYBRID_INLINE void look_around(Around& at, const float* own, std::ptrdiff_t z) {
  load(at.own, own);
  load(at.y_down, own - kRow);
  load(at.y_up, own + kRow);
  load(at.z_down, own - z);
  load(at.z_up, own + z);
}
// The octets of a span with one more at both ends; of those, only the lane that touches the span is true.
struct Span {
  std::array<Octet, kOctets + 2> at;
};
HYBRID_INLINE void ends_of(Span& s, const float* own, std::ptrdiff_t x, OctetSpan span) {
  const float before = span.first > 0 ? own[span.first * kOctet - 1] : own[kRow - 1 - x];
  const float after = span.last < kOctets - 1 ? own[(span.last + 1) * kOctet] : own[x];
  s.at[0] = Octet{} + before;
  s.at[static_cast<std::size_t>(span.last - span.first + 2)] = Octet{} + after;
}

// What links allow a voxel.
struct Interval {
  Octet low, high;
};
HYBRID_INLINE void everywhere(Interval& in) {
  in.low = Octet{} - kFar;
  in.high = Octet{} + kFar;
}
// … the link to the neighbour above, which stands at `to`, and the one to the neighbour below.
// None; none as long as nothing comes near the tightest; one set for the row; each lane its own.
enum class Limits : std::uint8_t { none, look, row, lanes };
constexpr bool clamps(Limits l) {
  return l == Limits::row || l == Limits::lanes;
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
HYBRID_INLINE void narrow(Interval& in, const Octet& up, const Octet& down, const AxisSprings& s,
                          const AxisBounds& b, std::size_t d, int octet) {
  if constexpr (kLimits == Limits::lanes) {
    Octet low, high;
    load(low, b.up_low[d] + octet * kOctet);
    load(high, b.up_high[d] + octet * kOctet);
    low *= b.sign[d];
    take_largest(in.low, up - high);
    take_least(in.high, up - low);
    load(low, b.down_low[d] + octet * kOctet);
    load(high, b.down_high[d] + octet * kOctet);
    low *= b.sign[d];
    take_largest(in.low, down + low);
    take_least(in.high, down + high);
  } else {
    Octet above_low = up - b.row.high[d], above_high = up - b.row.low[d];
    Octet below_low = down + b.row.low[d], below_high = down + b.row.high[d];
    if (!kUniform) {
      Octet k;
      load(k, s.up[d] + octet * kOctet);
      above_low = k > 0.0F ? above_low : in.low;
      above_high = k > 0.0F ? above_high : in.high;
      load(k, s.down[d] + octet * kOctet);
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
HYBRID_INLINE void bring_into(Octet& wanted, const Interval& in, const Octet& now) {
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
HYBRID_INLINE void note_beyond(OctetMask& beyond, const Octet& own, const Octet& x_down, const Octet& x_up,
                               const Around& at, const AxisSprings& s, const Band& band, int octet) {
  const std::array<Octet, 3> up{x_up - own, at.y_up - own, at.z_up - own},
      down{own - x_down, own - at.y_down, own - at.z_down};
  for (std::size_t d = 0; d < 3; ++d) {
    OctetMask out;
    if (kUniform) {
      Octet most{};
      take_largest_size(most, up[d]);
      take_largest_size(most, down[d]);
      out = most >= band.most[d];
    } else {
      Octet above{}, below{}, k;
      take_largest_size(above, up[d]);
      take_largest_size(below, down[d]);
      load(k, s.up[d] + octet * kOctet);
      out = (above >= band.most[d]) & (k > 0.0F);
      load(k, s.down[d] + octet * kOctet);
      out |= (below >= band.most[d]) & (k > 0.0F);
    }
    beyond |= out;
  }
}
HYBRID_INLINE bool any(const OctetMask& mask) {
  std::array<std::uint64_t, 4> words;
  std::memcpy(words.data(), &mask, sizeof words);
  return (words[0] | words[1] | words[2] | words[3]) != 0;
}

// Lanes of an axis that do not move.
HYBRID_INLINE void staying(OctetMask& stays, const LevelRow& row, const Octet& inverse, std::size_t axis,
                           int octet) {
  stays = inverse == 0.0F;
  if (row.held != nullptr) {
    OctetMask bits;
    bits_set(bits, row.held + octet * kOctet, 1);
    stays |= bits;
  }
  if (row.stopped != nullptr) {
    OctetMask bits;
    bits_set(bits, row.stopped + octet * kOctet, 1 << axis);
    stays |= bits;
  }
}

template <bool kUniform, Limits kLimits>
HYBRID_INLINE bool smooth_axis(const LevelRow& row, const AxisBounds& bounds, std::size_t axis,
                               OctetSpan span, Octet& most) {
  const AxisSprings s(row.springs, axis);
  float* own = row.u[axis];
  Span u;
  std::array<Octet, kOctets> beside;
  std::array<OctetMask, kOctets> stays;
  std::array<Interval, clamps(kLimits) ? kOctets : 1> allowed;
  ends_of(u, own, row.x, span);
  const int count = span.last - span.first + 1;
#pragma GCC unroll 1
  for (int n = 0; n < count; ++n) {
    const int octet = span.first + n;
    const auto un = static_cast<std::size_t>(n);
    Around at;
    look_around(at, own + octet * kOctet, row.z);
    u.at[un + 1] = at.own;
    Octet kyd, kyu, kzd, kzu, inverse;
    spring<kUniform>(kyd, s.down[1], octet);
    spring<kUniform>(kyu, s.up[1], octet);
    spring<kUniform>(kzd, s.down[2], octet);
    spring<kUniform>(kzu, s.up[2], octet);
    spring<kUniform>(inverse, s.inverse, octet);
    Octet sum = kyd * at.y_down + kyu * at.y_up + kzd * at.z_down + kzu * at.z_up;
    if (row.load[axis] != nullptr) {
      Octet force;
      load(force, row.load[axis] + octet * kOctet);
      sum += force;
    }
    beside[un] = sum;
    staying(stays[un], row, inverse, axis, octet);
    if constexpr (clamps(kLimits)) {
      everywhere(allowed[un]);
      narrow_beside<kUniform, kLimits>(allowed[un], at, s, bounds, octet);
    }
  }
#pragma GCC unroll 1
  for (int colour = 0; colour < 2; ++colour) {
#pragma GCC unroll 1
    for (int n = 0; n < count; ++n) {
      const int octet = span.first + n;
      const auto un = static_cast<std::size_t>(n);
      const Octet now = u.at[un + 1];
      Octet x_down, x_up, kxd, kxu, inverse;
      shift_down(x_down, u.at[un], now);
      shift_up(x_up, now, u.at[un + 2]);
      spring<kUniform>(kxd, s.down[0], octet);
      spring<kUniform>(kxu, s.up[0], octet);
      spring<kUniform>(inverse, s.inverse, octet);
      Octet wanted = (kxd * x_down + kxu * x_up + beside[un]) * inverse;
      if (row.hold != nullptr) {
        Octet hold, told;
        load(hold, row.hold + octet * kOctet);
        load(told, row.told[axis] + octet * kOctet);
        hold *= row.hold_times;
        wanted += (told - wanted) * hold / (1.0F + hold);
      }
      if constexpr (clamps(kLimits)) {
        Interval in = allowed[un];
        narrow<kUniform, kLimits>(in, x_up, x_down, s, bounds, 0, octet);
        bring_into(wanted, in, now);
      }
      const OctetMask taken = (colour == 0 ? kEven : ~kEven) & ~stays[un];
      select(u.at[un + 1], taken, wanted, now);
    }
  }
  if constexpr (kLimits == Limits::look) {
    const Band band(bounds.row);
    OctetMask beyond{};
#pragma GCC unroll 1
    for (int n = 0; n < count; ++n) {
      const int octet = span.first + n;
      const auto un = static_cast<std::size_t>(n);
      Around at;
      look_around(at, own + octet * kOctet, row.z);
      Octet x_down, x_up;
      shift_down(x_down, u.at[un], u.at[un + 1]);
      shift_up(x_up, u.at[un + 1], u.at[un + 2]);
      note_beyond<kUniform>(beyond, u.at[un + 1], x_down, x_up, at, s, band, octet);
    }
    if (any(beyond)) return false;
  }
#pragma GCC unroll 1
  for (int n = 0; n < count; ++n) {
    float* to = own + (span.first + n) * kOctet;
    Octet before;
    load(before, to);
    take_largest_size(most, u.at[static_cast<std::size_t>(n) + 1] - before);
    store(to, u.at[static_cast<std::size_t>(n) + 1]);
  }
  return true;
}

// Where a row has no limits, what is said of them is not looked at.
HYBRID_INLINE AxisBounds bounds_of(const RowLimits* limits, std::size_t axis) {
  static constexpr std::array<AxisLimits, 3> kNone{};
  return limits != nullptr ? AxisBounds(*limits, axis) : AxisBounds(RowLimits{&kNone, nullptr}, axis);
}

// One spring of an octet; `axis` and `d` are known when this is compiled.
template <bool kUniform>
HYBRID_INLINE void spring_up(Octet& k, const RowCouplings& s, std::size_t axis, std::size_t d, int octet) {
  load(k, (d == axis ? s.up_along : s.up_across) + d * kRow + (kUniform ? 0 : octet * kOctet));
}
template <bool kUniform>
HYBRID_INLINE void spring_down(Octet& k, const RowCouplings& s, std::size_t axis, std::size_t d, int octet) {
  load(k, (d == axis ? s.down_along : s.down_across) + d * kRow + (kUniform ? 0 : octet * kOctet));
}
template <bool kUniform>
HYBRID_INLINE void inverse_of(Octet& inverse, const RowCouplings& s, std::size_t axis, int octet) {
  load(inverse, s.inverse + axis * kRow + (kUniform ? 0 : octet * kOctet));
}
template <bool kUniform>
HYBRID_INLINE void look_beyond(OctetMask& beyond, const Octet& own, const Octet& x_down, const Octet& x_up,
                               const LevelRow& row, const Band& band, std::size_t axis, int octet) {
  const float* at = row.u[axis] + octet * kOctet;
  for (std::size_t d = 0; d < 3; ++d) {
    Octet above = x_up, below = x_down;
    if (d > 0) {
      load(above, at + (d == 1 ? kRow : row.z));
      load(below, at - (d == 1 ? kRow : row.z));
    }
    Octet up{}, down{};
    take_largest_size(up, above - own);
    take_largest_size(down, own - below);
    if (kUniform) {
      take_largest(up, down);
      beyond |= up >= band.most[d];
    } else {
      Octet k;
      spring_up<false>(k, row.springs, axis, d, octet);
      beyond |= (up >= band.most[d]) & (k > 0.0F);
      spring_down<false>(k, row.springs, axis, d, octet);
      beyond |= (down >= band.most[d]) & (k > 0.0F);
    }
  }
}

// The axes side by side: each alone is a chain of operations that wait for one another.
using Axes = std::array<std::array<Octet, kOctets + 2>, 3>;

HYBRID_INLINE void load_axes(Axes& u, const LevelRow& row, OctetSpan span) {
  const int count = span.last - span.first + 1;
#pragma GCC unroll 3
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float* own = row.u[axis];
    const float before = span.first > 0 ? own[span.first * kOctet - 1] : own[kRow - 1 - row.x];
    const float after = span.last < kOctets - 1 ? own[(span.last + 1) * kOctet] : own[row.x];
    u[axis][0] = Octet{} + before;
    u[axis][static_cast<std::size_t>(count + 1)] = Octet{} + after;
  }
#pragma GCC unroll 1
  for (int n = 0; n < count; ++n) {
#pragma GCC unroll 3
    for (std::size_t axis = 0; axis < 3; ++axis)
      load(u[axis][static_cast<std::size_t>(n) + 1], row.u[axis] + (span.first + n) * kOctet);
  }
}

// Which axes may have links beyond the band, bit by bit, if the row stood at `u`.
// The same where each lane has limits of its own.
HYBRID_INLINE void look_beyond_lanes(OctetMask& beyond, const Octet& own, const Octet& x_down,
                                     const Octet& x_up, const LevelRow& row, const RowLimits::Written& w,
                                     std::size_t axis, int octet) {
  constexpr float kNear = 0.999F;
  const float* at = row.u[axis] + octet * kOctet;
  const auto lanes = static_cast<std::size_t>(octet * kOctet);
  for (std::size_t d = 0; d < 3; ++d) {
    Octet above = x_up, below = x_down, low, high;
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

template <bool kUniform>
HYBRID_INLINE unsigned beyond_band(const Axes& u, const LevelRow& row, const RowLimits& limits,
                                   OctetSpan span, float tight) {
  std::array<OctetMask, 3> beyond{};
  const std::array<Band, 3> band{Band((*limits.of)[0], tight), Band((*limits.of)[1], tight),
                                 Band((*limits.of)[2], tight)};
#pragma GCC unroll 1
  for (int octet = span.first; octet <= span.last; ++octet) {
    const auto n = static_cast<std::size_t>(octet - span.first);
#pragma GCC unroll 3
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Octet x_down, x_up;
      shift_down(x_down, u[axis][n], u[axis][n + 1]);
      shift_up(x_up, u[axis][n + 1], u[axis][n + 2]);
      look_beyond<kUniform>(beyond[axis], u[axis][n + 1], x_down, x_up, row, band[axis], axis, octet);
    }
  }
  unsigned out = 0;
  const OctetMask all = beyond[0] | beyond[1] | beyond[2];
  if (!any(all)) return out;
  if (!kUniform && limits.lanes != nullptr) {
    // Tighter links are elsewhere in the row, mostly.
    beyond = {};
#pragma GCC unroll 1
    for (int octet = span.first; octet <= span.last; ++octet) {
      const auto n = static_cast<std::size_t>(octet - span.first);
#pragma GCC unroll 3
      for (std::size_t axis = 0; axis < 3; ++axis) {
        Octet x_down, x_up;
        shift_down(x_down, u[axis][n], u[axis][n + 1]);
        shift_up(x_up, u[axis][n + 1], u[axis][n + 2]);
        look_beyond_lanes(beyond[axis], u[axis][n + 1], x_down, x_up, row, *limits.lanes, axis, octet);
      }
    }
  }
  for (std::size_t axis = 0; axis < 3; ++axis) out |= any(beyond[axis]) ? 1U << axis : 0U;
  return out;
}

// Smooths the axes on which no limit comes near; returns the others, bit by bit, left as they were.
template <bool kUniform, bool kLook>
HYBRID_INLINE unsigned smooth_freely(const LevelRow& row, const RowLimits* limits, OctetSpan span,
                                     Octet& most) {
  const RowCouplings& s = row.springs;
  Axes u, beside;
  std::array<std::array<OctetMask, kOctets>, 3> stays;
  load_axes(u, row, span);
#pragma GCC unroll 1
  for (int octet = span.first; octet <= span.last; ++octet) {
    const auto n = static_cast<std::size_t>(octet - span.first);
#pragma GCC unroll 3
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float* own = row.u[axis] + octet * kOctet;
      Octet k, value, sum;
      spring_down<kUniform>(k, s, axis, 1, octet);
      load(value, own - kRow);
      sum = k * value;
      spring_up<kUniform>(k, s, axis, 1, octet);
      load(value, own + kRow);
      sum += k * value;
      spring_down<kUniform>(k, s, axis, 2, octet);
      load(value, own - row.z);
      sum += k * value;
      spring_up<kUniform>(k, s, axis, 2, octet);
      load(value, own + row.z);
      sum += k * value;
      if (row.load[axis] != nullptr) {
        load(value, row.load[axis] + octet * kOctet);
        sum += value;
      }
      beside[axis][n] = sum;
      inverse_of<kUniform>(k, s, axis, octet);
      staying(stays[axis][n], row, k, axis, octet);
    }
  }
#pragma GCC unroll 1
  for (int colour = 0; colour < 2; ++colour) {
    const OctetMask own_colour = colour == 0 ? kEven : ~kEven;
#pragma GCC unroll 1
    for (int octet = span.first; octet <= span.last; ++octet) {
      const auto n = static_cast<std::size_t>(octet - span.first);
      Octet hold{};
      if (row.hold != nullptr) {
        load(hold, row.hold + octet * kOctet);
        hold *= row.hold_times;
        hold = hold / (1.0F + hold);
      }
#pragma GCC unroll 3
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const Octet now = u[axis][n + 1];
        Octet x_down, x_up, kxd, kxu, inverse;
        shift_down(x_down, u[axis][n], now);
        shift_up(x_up, now, u[axis][n + 2]);
        spring_down<kUniform>(kxd, s, axis, 0, octet);
        spring_up<kUniform>(kxu, s, axis, 0, octet);
        inverse_of<kUniform>(inverse, s, axis, octet);
        Octet wanted = (kxd * x_down + kxu * x_up + beside[axis][n]) * inverse;
        if (row.hold != nullptr) {
          Octet told;
          load(told, row.told[axis] + octet * kOctet);
          wanted += (told - wanted) * hold;
        }
        select(u[axis][n + 1], own_colour & ~stays[axis][n], wanted, now);
      }
    }
  }
  unsigned beyond = 0;
  if constexpr (kLook) beyond = beyond_band<kUniform>(u, row, *limits, span, 0.0F);
#pragma GCC unroll 1
  for (int octet = span.first; octet <= span.last; ++octet) {
    const auto n = static_cast<std::size_t>(octet - span.first);
#pragma GCC unroll 3
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (kLook && (beyond >> axis & 1U) != 0) continue;
      float* to = row.u[axis] + octet * kOctet;
      Octet before;
      load(before, to);
      take_largest_size(most, u[axis][n + 1] - before);
      store(to, u[axis][n + 1]);
    }
  }
  return beyond;
}

// First as if there were no limits, and again with them where they matter.
template <bool kUniform, Limits kLimits>
HYBRID_INLINE float smooth_axes(const LevelRow& row, const RowLimits* limits, OctetSpan span) {
  Octet most{};
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
HYBRID_INLINE void residual_axis(RowResidual& result, const LevelRow& row, const AxisBounds& bounds,
                                 std::size_t axis, float tight, OctetSpan span, float* out, Octet& most_N,
                                 Octet& most_m) {
  const AxisSprings s(row.springs, axis);
  const float* own = row.u[axis];
  Span u;
  const Band band(bounds.row, tight);
  ends_of(u, own, row.x, span);
  const int count = span.last - span.first + 1;
#pragma GCC unroll 1
  for (int n = 0; n < count; ++n)
    load(u.at[static_cast<std::size_t>(n) + 1], own + (span.first + n) * kOctet);
#pragma GCC unroll 1
  for (int n = 0; n < count; ++n) {
    const int octet = span.first + n;
    const auto un = static_cast<std::size_t>(n);
    Around at;
    look_around(at, own + octet * kOctet, row.z);
    Octet x_down, x_up, kxd, kxu, kyd, kyu, kzd, kzu, inverse;
    shift_down(x_down, u.at[un], at.own);
    shift_up(x_up, at.own, u.at[un + 2]);
    spring<kUniform>(kxd, s.down[0], octet);
    spring<kUniform>(kxu, s.up[0], octet);
    spring<kUniform>(kyd, s.down[1], octet);
    spring<kUniform>(kyu, s.up[1], octet);
    spring<kUniform>(kzd, s.down[2], octet);
    spring<kUniform>(kzu, s.up[2], octet);
    spring<kUniform>(inverse, s.inverse, octet);
    Octet r = kxd * (x_down - at.own) + kxu * (x_up - at.own) + kyd * (at.y_down - at.own) +
              kyu * (at.y_up - at.own) + kzd * (at.z_down - at.own) + kzu * (at.z_up - at.own);
    if (row.load[axis] != nullptr) {
      Octet force;
      load(force, row.load[axis] + octet * kOctet);
      r += force;
    }
    if (row.hold != nullptr) {
      Octet hold, told;
      load(hold, row.hold + octet * kOctet);
      load(told, row.told[axis] + octet * kOctet);
      const Octet safe = inverse == 0.0F ? Octet{} + 1.0F : inverse;
      r += row.hold_times * hold / safe * (told - at.own);
    }
    OctetMask stays;
    staying(stays, row, inverse, axis, octet);
    r = stays ? Octet{} : r;
    if constexpr (clamps(kLimits)) {
      OctetMask beyond{};
      note_beyond<kUniform>(beyond, at.own, x_down, x_up, at, s, band, octet);
      if (any(beyond)) {
        Interval in;
        everywhere(in);
        narrow_beside<kUniform, kLimits>(in, at, s, bounds, octet);
        narrow<kUniform, kLimits>(in, x_up, x_down, s, bounds, 0, octet);
        const OctetMask resisted =
            ((r > 0.0F) & (at.own >= in.high - tight)) | ((r < 0.0F) & (at.own <= in.low + tight));
        r = resisted ? Octet{} : r;
        for (int i = 0; i < kOctet; ++i)
          result.resisted[axis] |= (resisted[i] != 0 ? 1U : 0U) << (octet * kOctet + i);
      }
    }
    store(out + octet * kOctet, r);
    take_largest_size(most_N, r);
    take_largest_size(most_m, r * inverse);
  }
}

template <bool kUniform, Limits kLimits>
HYBRID_INLINE void residual_axes(RowResidual& result, const LevelRow& row, const RowLimits* limits,
                                 float tight, OctetSpan span, RowVector& out) {
  Octet most_N{}, most_m{};
#pragma GCC unroll 1
  for (std::size_t axis = 0; axis < 3; ++axis) {
    residual_axis<kUniform, kLimits>(result, row, bounds_of(limits, axis), axis, tight, span,
                                     out[axis].data(), most_N, most_m);
  }
  result.most_N = largest(most_N);
  result.most_way_m = largest(most_m);
}

template <bool kUniform, Limits kLimits>
HYBRID_INLINE bool correct_axis(const LevelRow& row, const AxisBounds& bounds, std::size_t axis,
                                OctetSpan span, const float* correction, Octet& most) {
  const AxisSprings s(row.springs, axis);
  float* own = row.u[axis];
  const int count = span.last - span.first + 1;
  Span u;
  std::array<Octet, kOctets> target;
  std::array<OctetMask, kOctets> stays;
  if (kLimits != Limits::none) ends_of(u, own, row.x, span);
#pragma GCC unroll 1
  for (int n = 0; n < count; ++n) {
    const int octet = span.first + n;
    const auto un = static_cast<std::size_t>(n);
    Octet now, way, inverse;
    load(now, own + octet * kOctet);
    load(way, correction + octet * kOctet);
    spring<kUniform>(inverse, s.inverse, octet);
    staying(stays[un], row, inverse, axis, octet);
    take_largest_size(most, way);
    target[un] = stays[un] ? now : now + way;
    u.at[un + 1] = now;
  }
  if constexpr (clamps(kLimits)) {
    std::array<Interval, kOctets> allowed;
#pragma GCC unroll 1
    for (int n = 0; n < count; ++n) {
      const int octet = span.first + n;
      Around at;
      look_around(at, own + octet * kOctet, row.z);
      everywhere(allowed[static_cast<std::size_t>(n)]);
      narrow_beside<kUniform, kLimits>(allowed[static_cast<std::size_t>(n)], at, s, bounds, octet);
    }
    // Every second voxel at a time: beside neighbours that stand still, a limit is a plain interval.
#pragma GCC unroll 1
    for (int colour = 0; colour < 2; ++colour) {
#pragma GCC unroll 1
      for (int n = 0; n < count; ++n) {
        const int octet = span.first + n;
        const auto un = static_cast<std::size_t>(n);
        const Octet now = u.at[un + 1];
        Octet x_down, x_up, wanted = target[un];
        shift_down(x_down, u.at[un], now);
        shift_up(x_up, now, u.at[un + 2]);
        Interval in = allowed[un];
        narrow<kUniform, kLimits>(in, x_up, x_down, s, bounds, 0, octet);
        bring_into(wanted, in, now);
        const OctetMask taken = (colour == 0 ? kEven : ~kEven) & ~stays[un];
        select(u.at[un + 1], taken, wanted, now);
      }
    }
#pragma GCC unroll 1
    for (int n = 0; n < count; ++n)
      store(own + (span.first + n) * kOctet, u.at[static_cast<std::size_t>(n) + 1]);
    return true;
  }
  if constexpr (kLimits == Limits::look) {
    const Band band(bounds.row);
    OctetMask beyond{};
#pragma GCC unroll 1
    for (int n = 0; n < count; ++n)
      u.at[static_cast<std::size_t>(n) + 1] = target[static_cast<std::size_t>(n)];
#pragma GCC unroll 1
    for (int n = 0; n < count; ++n) {
      const int octet = span.first + n;
      const auto un = static_cast<std::size_t>(n);
      Around at;
      look_around(at, own + octet * kOctet, row.z);
      Octet x_down, x_up;
      shift_down(x_down, u.at[un], u.at[un + 1]);
      shift_up(x_up, u.at[un + 1], u.at[un + 2]);
      note_beyond<kUniform>(beyond, u.at[un + 1], x_down, x_up, at, s, band, octet);
    }
    if (any(beyond)) return false;
  }
#pragma GCC unroll 1
  for (int n = 0; n < count; ++n) store(own + (span.first + n) * kOctet, target[static_cast<std::size_t>(n)]);
  return true;
}

// Adds corrections on the axes on which no limit comes near; returns the others, bit by bit, left as they
// were.
template <bool kUniform, bool kLook>
HYBRID_INLINE unsigned correct_freely(const LevelRow& row, const RowLimits* limits, OctetSpan span,
                                      const RowVector& correction, Octet& most) {
  Axes u;
  if (kLook) {
    load_axes(u, row, span);
  }
#pragma GCC unroll 1
  for (int octet = span.first; octet <= span.last; ++octet) {
    const auto n = static_cast<std::size_t>(octet - span.first);
#pragma GCC unroll 3
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Octet now, way, inverse;
      OctetMask stays;
      load(now, row.u[axis] + octet * kOctet);
      load(way, correction[axis].data() + octet * kOctet);
      inverse_of<kUniform>(inverse, row.springs, axis, octet);
      staying(stays, row, inverse, axis, octet);
      take_largest_size(most, way);
      u[axis][n + 1] = stays ? now : now + way;
    }
  }
  unsigned beyond = 0;
  if constexpr (kLook) beyond = beyond_band<kUniform>(u, row, *limits, span, 0.0F);
#pragma GCC unroll 1
  for (int octet = span.first; octet <= span.last; ++octet) {
    const auto n = static_cast<std::size_t>(octet - span.first);
#pragma GCC unroll 3
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!kLook || (beyond >> axis & 1U) == 0) store(row.u[axis] + octet * kOctet, u[axis][n + 1]);
    }
  }
  return beyond;
}

template <bool kUniform, Limits kLimits>
HYBRID_INLINE float correct_axes(const LevelRow& row, const RowLimits* limits, OctetSpan span,
                                 const RowVector& correction) {
  Octet most{};
  const unsigned beyond = correct_freely<kUniform, clamps(kLimits)>(row, limits, span, correction, most);
  if constexpr (clamps(kLimits)) {
#pragma GCC unroll 1
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if ((beyond >> axis & 1U) == 0) continue;
      correct_axis<kUniform, kLimits>(row, bounds_of(limits, axis), axis, span, correction[axis].data(),
                                      most);
    }
  }
  return largest(most);
}

}  // namespace

HYBRID_WIDE float smooth_row(const LevelRow& row, const RowLimits* limits, OctetSpan span) noexcept {
  const bool uniform = row.springs.uniform;
  if (limits == nullptr)
    return uniform ? smooth_axes<true, Limits::none>(row, limits, span)
                   : smooth_axes<false, Limits::none>(row, limits, span);
  if (limits->lanes != nullptr) return smooth_axes<false, Limits::lanes>(row, limits, span);
  return uniform ? smooth_axes<true, Limits::row>(row, limits, span)
                 : smooth_axes<false, Limits::row>(row, limits, span);
}

HYBRID_WIDE RowResidual residual_row(const LevelRow& row, const RowLimits* limits, float tight_m,
                                     OctetSpan span, RowVector& out) noexcept {
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

HYBRID_WIDE void measure_row(const RowCouplings& springs, const RowVector& residual, OctetSpan span,
                             RowResidual& out) noexcept {
  Octet most_N{}, most_m{};
#pragma GCC unroll 1
  for (std::size_t axis = 0; axis < 3; ++axis) {
#pragma GCC unroll 1
    for (int octet = span.first; octet <= span.last; ++octet) {
      Octet r, inverse;
      load(r, residual[axis].data() + octet * kOctet);
      load(inverse, springs.inverse + axis * kRow + octet * kOctet);
      take_largest_size(most_N, r);
      take_largest_size(most_m, r * inverse);
    }
  }
  out.most_N = largest(most_N);
  out.most_way_m = largest(most_m);
}

HYBRID_WIDE void add_pairs(const float* fine, OctetSpan span, float* half) noexcept {
#pragma GCC unroll 1
  for (int octet = span.first; octet < span.last; octet += 2) {
    Octet a, b, sum;
    load(a, fine + octet * kOctet);
    load(b, fine + (octet + 1) * kOctet);
    load(sum, half + octet / 2 * kOctet);
    const Octet even = __builtin_shufflevector(a, b, 0, 2, 4, 6, 8, 10, 12, 14),
                odd = __builtin_shufflevector(a, b, 1, 3, 5, 7, 9, 11, 13, 15);
    sum += even + odd;
    store(half + octet / 2 * kOctet, sum);
  }
}

HYBRID_WIDE void take_means(const RowVector& sums, const float* share, const std::array<float*, 3>& value,
                            const std::array<float*, 3>& told, OctetSpan span) noexcept {
#pragma GCC unroll 1
  for (std::size_t axis = 0; axis < 3; ++axis) {
#pragma GCC unroll 1
    for (int octet = span.first; octet <= span.last; ++octet) {
      Octet mean, part, v, t;
      load(mean, sums[axis].data() + octet * kOctet);
      load(part, share + octet * kOctet);
      load(v, value[axis] + octet * kOctet);
      load(t, told[axis] + octet * kOctet);
      mean *= part;
      store(value[axis] + octet * kOctet, mean + (v - t));
      store(told[axis] + octet * kOctet, mean);
    }
  }
}

HYBRID_WIDE void take_loads(const LevelRow& row, const RowVector& force, const std::array<float*, 3>& to,
                            OctetSpan span) noexcept {
  const RowCouplings& s = row.springs;
  Axes u;
  load_axes(u, row, span);
#pragma GCC unroll 1
  for (int octet = span.first; octet <= span.last; ++octet) {
    const auto n = static_cast<std::size_t>(octet - span.first);
    const int lane = octet * kOctet;
#pragma GCC unroll 3
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float* at = row.u[axis] + lane;
      const Octet own = u[axis][n + 1];
      Octet k, value, sum;
      shift_down(value, u[axis][n], own);
      spring_down<false>(k, s, axis, 0, octet);
      sum = k * (value - own);
      shift_up(value, own, u[axis][n + 2]);
      spring_up<false>(k, s, axis, 0, octet);
      sum += k * (value - own);
      for (std::size_t d = 1; d < 3; ++d) {
        const std::ptrdiff_t stride = d == 1 ? kRow : row.z;
        load(value, at - stride);
        spring_down<false>(k, s, axis, d, octet);
        sum += k * (value - own);
        load(value, at + stride);
        spring_up<false>(k, s, axis, d, octet);
        sum += k * (value - own);
      }
      load(value, force[axis].data() + lane);
      store(to[axis] + lane, value - sum);
    }
  }
}

HYBRID_WIDE void interpolate_row(const CoarseRows& c, OctetSpan span, RowVector& out) noexcept {
  static constexpr std::array<float, 4> kShare{0.5625F, 0.1875F, 0.1875F, 0.0625F};
  const int first = c.half + span.first * kOctet / 2;  // coarse lane
  const int count = (span.last - span.first + 1) / 2;  // coarse octets
  const int end = first + count * kOctet;
  // Sums over the four rows, for the coarse octets and one lane more at both ends.
  std::array<Octet, kOctets / 2 + 2> weight{};
  std::array<std::array<Octet, kOctets / 2 + 2>, 3> value{};
  float weight_left = 0.0F, weight_right = 0.0F;
  std::array<float, 3> left{}, right{};
  constexpr OctetMask kLane{0, 1, 2, 3, 4, 5, 6, 7};
  const bool tells_left = first - 1 >= c.first_teller && first - 1 <= c.last_teller,
             tells_right = end >= c.first_teller && end <= c.last_teller;
#pragma GCC unroll 1
  for (std::size_t n = 0; n < 4; ++n) {
    const CoarseRows::One& r = c.row[n];
    if (r.filled != nullptr) {
#pragma GCC unroll 1
      for (int m = 0; m < count; ++m) {
        const auto um = static_cast<std::size_t>(m) + 1;
        const int lane = first + m * kOctet;
        Octet f;
        load(f, r.filled + lane);
        f *= kShare[n];
        weight[um] += f;
        if (!r.tells) continue;
        const OctetMask at = kLane + lane;
        f = (at >= c.first_teller) & (at <= c.last_teller) ? f : Octet{};
#pragma GCC unroll 3
        for (std::size_t axis = 0; axis < 3; ++axis) {
          Octet v, t;
          load(v, r.value[axis] + lane);
          load(t, r.told[axis] + lane);
          value[axis][um] += f * (v - t);
        }
      }
    }
    const float *before = first > 0 ? r.filled : r.filled_left,
                *behind = end < kRow ? r.filled : r.filled_right;
    if (before != nullptr) {
      const float f = kShare[n] * before[first > 0 ? first - 1 : kRow - 1];
      weight_left += f;
      if (r.tells && tells_left) {
        const std::ptrdiff_t at = first > 0 ? first - 1 : kRow - 1 - c.x;
        for (std::size_t axis = 0; axis < 3; ++axis) left[axis] += f * (r.value[axis][at] - r.told[axis][at]);
      }
    }
    if (behind != nullptr) {
      const float f = kShare[n] * behind[end < kRow ? end : 0];
      weight_right += f;
      if (r.tells && tells_right) {
        const std::ptrdiff_t at = end < kRow ? end : c.x;
        for (std::size_t axis = 0; axis < 3; ++axis)
          right[axis] += f * (r.value[axis][at] - r.told[axis][at]);
      }
    }
  }
  const auto after = static_cast<std::size_t>(count) + 1;
  weight[0] = Octet{} + weight_left;
  weight[after] = Octet{} + weight_right;
#pragma GCC unroll 3
  for (std::size_t axis = 0; axis < 3; ++axis) {
    value[axis][0] = Octet{} + left[axis];
    value[axis][after] = Octet{} + right[axis];
  }
#pragma GCC unroll 1
  for (int m = 0; m < count; ++m) {
    const auto um = static_cast<std::size_t>(m) + 1;
    // 3/4 of the own cell and 1/4 of the nearer neighbour, for the lower and the upper four cells.
    const auto low = [um](Octet& to, const auto& x) {
      to = 0.75F * __builtin_shufflevector(x[um], x[um], 0, 0, 1, 1, 2, 2, 3, 3) +
           0.25F * __builtin_shufflevector(x[um - 1], x[um], 7, 9, 8, 10, 9, 11, 10, 12);
    };
    const auto high = [um](Octet& to, const auto& x) {
      to = 0.75F * __builtin_shufflevector(x[um], x[um], 4, 4, 5, 5, 6, 6, 7, 7) +
           0.25F * __builtin_shufflevector(x[um], x[um + 1], 3, 5, 4, 6, 5, 7, 6, 8);
    };
    Octet w_low, w_high;
    low(w_low, weight);
    high(w_high, weight);
    const Octet one = Octet{} + 1.0F;
    w_low = w_low > 0.0F ? one / w_low : Octet{};
    w_high = w_high > 0.0F ? one / w_high : Octet{};
#pragma GCC unroll 3
    for (std::size_t axis = 0; axis < 3; ++axis) {
      float* to = out[axis].data() + (span.first + 2 * m) * kOctet;
      Octet v;
      low(v, value[axis]);
      store(to, v * w_low);
      high(v, value[axis]);
      store(to + kOctet, v * w_high);
    }
  }
}

HYBRID_WIDE float row_difference(const float* a, const float* b, OctetSpan span) noexcept {
  Octet most{}, x, y;
#pragma GCC unroll 1
  for (int octet = span.first; octet <= span.last; ++octet) {
    load(x, a + octet * kOctet);
    load(y, b + octet * kOctet);
    take_largest_size(most, x - y);
  }
  return largest(most);
}

HYBRID_WIDE float correct_row(const LevelRow& row, const RowLimits* limits, OctetSpan span,
                              const RowVector& correction) noexcept {
  if (limits == nullptr) return correct_axes<false, Limits::none>(row, limits, span, correction);
  if (limits->lanes != nullptr) return correct_axes<false, Limits::lanes>(row, limits, span, correction);
  return row.springs.uniform ? correct_axes<true, Limits::row>(row, limits, span, correction)
                             : correct_axes<false, Limits::row>(row, limits, span, correction);
}

}  // namespace voxel::sparse
