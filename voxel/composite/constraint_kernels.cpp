// SPDX-License-Identifier: GPL-3.0-or-later
// Bounds of nodes and multipliers of links (row_kernels.h), one level array at a time.
#include <algorithm>

#include "voxel/composite/row_kernels.h"

namespace voxel::composite {
namespace {

// Range of the factor by which one cycle may change the weight of a link at its limit.
constexpr float kMaxCycleFactor = 2.0F, kMinCycleFactor = 0.25F;

LimitOfLinks from_node(LimitOfLinks limit, std::size_t n) {
  if (limit.at_node != nullptr) limit.at_node += n;
  return limit;
}

// Limits of the links from 8 nodes, n and after, to the nodes `by` floats further on.
HYBRID_INLINE void limit_of(Float8& out, const LimitOfLinks& limit, std::ptrdiff_t n, std::size_t by) {
  if (limit.at_node == nullptr) {
    out = Float8{} + limit.all_m;
    return;
  }
  Float8 own, next;
  load(own, limit.at_node + n);
  load(next, limit.at_node + n + by);
  out = limit.half_length_m * (own + next);
}

// The fall over each link; without a link, more than any bound.
HYBRID_INLINE void fall_over(Float8& fall, const float* weight, const LimitOfLinks& limit, std::ptrdiff_t n,
                             std::size_t by) {
  Float8 w, over;
  load(w, weight + n);
  limit_of(over, limit, n, by);
  const Float8 none = Float8{} - kNoBound;
  fall = w > Float8{} ? over : none;
}

// Raises the bounds of a row from its low end to its high end: bound(i) becomes max(bound(i), bound(i − 1) −
// fall(i)). Within a vector of 8 bounds this is a scan with three shifts (Hillis & Steele 1986).
HYBRID_INLINE void sweep_row_up(float* bound, const float* weight, const LimitOfLinks& limit, int first,
                                int last) {
  const Float8 no_bound = Float8{} + kNoBound, zero{};
  Float8 carried = no_bound;
  for (int o = first; o <= last; ++o) {
    Float8 y, fall, from;
    load(y, bound + o * kLanes);
    fall_over(fall, weight, limit, o * kLanes - 1, 1);
    from = __builtin_shufflevector(no_bound, y, 0, 8, 9, 10, 11, 12, 13, 14);
    take_largest(y, from - fall);
    Float8 before = __builtin_shufflevector(zero, fall, 0, 8, 9, 10, 11, 12, 13, 14);
    fall += before;
    from = __builtin_shufflevector(no_bound, y, 0, 1, 8, 9, 10, 11, 12, 13);
    take_largest(y, from - fall);
    before = __builtin_shufflevector(zero, fall, 0, 1, 8, 9, 10, 11, 12, 13);
    fall += before;
    from = __builtin_shufflevector(no_bound, y, 0, 1, 2, 3, 8, 9, 10, 11);
    take_largest(y, from - fall);
    before = __builtin_shufflevector(zero, fall, 0, 1, 2, 3, 8, 9, 10, 11);
    fall += before;
    take_largest(y, carried - fall);
    carried = __builtin_shufflevector(y, y, 7, 7, 7, 7, 7, 7, 7, 7);
    store(bound + o * kLanes, y);
  }
}

HYBRID_INLINE void sweep_row_down(float* bound, const float* weight, const LimitOfLinks& limit, int first,
                                  int last) {
  const Float8 no_bound = Float8{} + kNoBound, zero{};
  Float8 carried = no_bound;
  for (int o = last; o >= first; --o) {
    Float8 y, fall, from;
    load(y, bound + o * kLanes);
    fall_over(fall, weight, limit, o * kLanes, 1);
    from = __builtin_shufflevector(y, no_bound, 1, 2, 3, 4, 5, 6, 7, 8);
    take_largest(y, from - fall);
    Float8 after = __builtin_shufflevector(fall, zero, 1, 2, 3, 4, 5, 6, 7, 8);
    fall += after;
    from = __builtin_shufflevector(y, no_bound, 2, 3, 4, 5, 6, 7, 8, 9);
    take_largest(y, from - fall);
    after = __builtin_shufflevector(fall, zero, 2, 3, 4, 5, 6, 7, 8, 9);
    fall += after;
    from = __builtin_shufflevector(y, no_bound, 4, 5, 6, 7, 8, 9, 10, 11);
    take_largest(y, from - fall);
    after = __builtin_shufflevector(fall, zero, 4, 5, 6, 7, 8, 9, 10, 11);
    fall += after;
    take_largest(y, carried - fall);
    carried = __builtin_shufflevector(y, y, 0, 0, 0, 0, 0, 0, 0, 0);
    store(bound + o * kLanes, y);
  }
}

// Raises the bounds of one of two neighbouring rows by the bounds of the other row. `n`: first node of the
// lower row. The upper row is `by` floats further on along d. `up`: raises the bounds of the upper row.
HYBRID_INLINE void raise_row(const BoundSweep& s, std::size_t d, std::size_t n, std::size_t by, bool up) {
  const float* const weight = s.weight[d] + n;
  const LimitOfLinks limit = from_node(up ? s.fall_up[d] : s.fall_down[d], n);
  float* const bound = s.bound + (up ? n + by : n);
  const float* const beside = s.bound + (up ? n : n + by);
  for (int o = s.low[0] / kLanes; o <= s.high[0] / kLanes; ++o) {
    Float8 y, from, fall;
    load(y, bound + o * kLanes);
    load(from, beside + o * kLanes);
    fall_over(fall, weight, limit, o * kLanes, by);
    take_largest(y, from - fall);
    store(bound + o * kLanes, y);
  }
}

HYBRID_INLINE void inverse_limits(Float8& per_longer, Float8& per_shorter, const LinkMultiplier& limit,
                                  std::ptrdiff_t n, std::size_t by) {
  const Float8 one = Float8{} + 1.0F;
  limit_of(per_longer, limit.longer, n, by);
  limit_of(per_shorter, limit.shorter, n, by);
  per_longer = one / per_longer;
  per_shorter = one / per_shorter;
}

}  // namespace

HYBRID_MULTIVERSIONED void sweep_bounds(const BoundSweep& s) noexcept {
  const int first = s.low[0] / kLanes, last = s.high[0] / kLanes;
  const auto row = [&s](int j, int k) {
    return static_cast<std::size_t>(k) * s.plane + static_cast<std::size_t>(j) * s.stride;
  };
  for (int k = s.low[2]; k <= s.high[2]; ++k) {
    for (int j = s.low[1]; j <= s.high[1]; ++j) {
      const std::size_t n = row(j, k);
      sweep_row_up(s.bound + n, s.weight[0] + n, from_node(s.fall_up[0], n), first, last);
      sweep_row_down(s.bound + n, s.weight[0] + n, from_node(s.fall_down[0], n), first, last);
    }
  }
  for (int k = s.low[2]; k <= s.high[2]; ++k) {
    for (int j = s.low[1]; j < s.high[1]; ++j) raise_row(s, 1, row(j, k), s.stride, true);
    for (int j = s.high[1] - 1; j >= s.low[1]; --j) raise_row(s, 1, row(j, k), s.stride, false);
  }
  for (int k = s.low[2]; k < s.high[2]; ++k) {
    for (int j = s.low[1]; j <= s.high[1]; ++j) raise_row(s, 2, row(j, k), s.plane, true);
  }
  for (int k = s.high[2] - 1; k >= s.low[2]; --k) {
    for (int j = s.low[1]; j <= s.high[1]; ++j) raise_row(s, 2, row(j, k), s.plane, false);
  }
}

// Before a cycle, nodes at a bound move with the bound, and nodes beyond their bound move onto it. Smoothing
// alone would move them by only one node a sweep. The reason: bounds fall off linearly with the distance from
// a pressed node, so the nodes at a bound form a cone with plane sides. On a plane side the links of a node
// balance. They pull only where two sides meet.
HYBRID_MULTIVERSIONED void follow_bounds(float* u, const float* at_bound, const float* lower,
                                         const float* negated_upper, float recedes_m,
                                         std::size_t count) noexcept {
  for (std::size_t n = 0; n < count; n += kLanes) {
    Float8 x, h;
    load(x, u + n);
    load(h, at_bound + n);
    const Float8 most = Float8{} + recedes_m, zero{};
    if (lower != nullptr) {
      Float8 low;
      load(low, lower + n);
      x = (((h > zero) & (x - low <= most)) | (low > x)) ? low : x;
    }
    if (negated_upper != nullptr) {
      Float8 high;
      load(high, negated_upper + n);
      high = -high;
      x = (((h < zero) & (high - x <= most)) | (high < x)) ? high : x;
    }
    store(u + n, x);
  }
}

HYBRID_MULTIVERSIONED void note_at_bound(float* at_bound, const float* u, const float* lower,
                                         const float* negated_upper, std::size_t count) noexcept {
  for (std::size_t n = 0; n < count; n += kLanes) {
    Float8 x, bound;
    load(x, u + n);
    const Float8 one = Float8{} + 1.0F;
    Float8 h{};
    if (lower != nullptr) {
      load(bound, lower + n);
      h = x <= bound ? one : h;
    }
    if (negated_upper != nullptr) {
      load(bound, negated_upper + n);
      h = x >= -bound ? -one : h;
    }
    store(at_bound + n, h);
  }
}

HYBRID_MULTIVERSIONED float largest_size(const float* u, std::size_t count) noexcept {
  Float8 most{};
  for (std::size_t n = 0; n < count; n += kLanes) {
    Float8 x;
    load(x, u + n);
    take_largest_size(most, x);
  }
  return largest(most);
}

HYBRID_MULTIVERSIONED float largest_limit_ratio(const float* u, const float* weight, std::size_t by,
                                                const LinkMultiplier& limit, std::size_t count) noexcept {
  Float8 most{};
  const Float8 zero{};
  for (std::size_t n = 0; n < count; n += kLanes) {
    Float8 own, next, g;
    load(own, u + n);
    load(next, u + n + by);
    load(g, weight + n);
    Float8 per_longer, per_shorter;
    inverse_limits(per_longer, per_shorter, limit, static_cast<std::ptrdiff_t>(n), by);
    const Float8 longer = next - own, of_high = per_longer * longer, of_low = -per_shorter * longer;
    Float8 of = of_high > of_low ? of_high : of_low;
    of = g > zero ? of : zero;
    take_largest(most, of);
  }
  float result = 0.0F;
  for (int lane = 0; lane < kLanes; ++lane) result = most[lane] > result ? most[lane] : result;
  return result;
}

HYBRID_MULTIVERSIONED float update_row_weights(const float* u, const float* weight, std::size_t by,
                                               const LinkMultiplier& limit, float* limited,
                                               std::size_t count) noexcept {
  Float8 most{};
  const Float8 zero{}, one = zero + 1.0F;
  const float above = 1.0F + limit.tolerance, below = 1.0F - limit.tolerance;
  for (std::size_t n = 0; n < count; n += kLanes) {
    Float8 own, next, g, h;
    load(own, u + n);
    load(next, u + n + by);
    load(g, weight + n);
    load(h, limited + n);
    Float8 per_longer, per_shorter;
    inverse_limits(per_longer, per_shorter, limit, static_cast<std::ptrdiff_t>(n), by);
    const Float8 longer = next - own, of_high = per_longer * longer, of_low = -per_shorter * longer;
    const Float8 of = of_high > of_low ? of_high : of_low;
    Float8 factor = of * (0.5F + 0.5F * of);
    factor = factor < kMaxCycleFactor ? factor : zero + kMaxCycleFactor;
    factor = factor > kMinCycleFactor ? factor : zero + kMinCycleFactor;
    factor = ((of > above) | (of < below)) ? factor : one;
    h *= factor;
    const Float8 stiffest = limit.max_factor * g;
    h = h > g ? h : g;
    h = h < stiffest ? h : stiffest;
    store(limited + n, h);
    Float8 ratio = h / g;
    ratio = g > zero ? ratio : zero;
    take_largest(most, ratio);
  }
  float result = 1.0F;
  for (int lane = 0; lane < kLanes; ++lane) result = most[lane] > result ? most[lane] : result;
  return result;
}

float updated_weight(float limited, float weight, float limit_ratio, const LinkMultiplier& limit) noexcept {
  if (limit_ratio > 1.0F + limit.tolerance || limit_ratio < 1.0F - limit.tolerance)
    limited *= std::clamp(limit_ratio * (0.5F + 0.5F * limit_ratio), kMinCycleFactor, kMaxCycleFactor);
  return std::clamp(limited, weight, limit.max_factor * weight);
}

HYBRID_MULTIVERSIONED double force_of_bounds(const LevelView& v, const std::array<int, 3>& finer_first,
                                             const std::array<int, 3>& finer_last) noexcept {
  const int vectors = static_cast<int>(v.stride / kLanes);
  const RowMask uncovered = uncovered_lanes(finer_first[0], finer_last[0], vectors);
  double sum = 0.0;
  for (int k = v.first[2]; k <= v.last[2]; ++k) {
    for (int j = v.first[1]; j <= v.last[1]; ++j) {
      const std::size_t row = static_cast<std::size_t>(k) * v.plane + static_cast<std::size_t>(j) * v.stride;
      const bool crosses =
          k >= finer_first[2] && k <= finer_last[2] && j >= finer_first[1] && j <= finer_last[1];
      Float8 of_row{};
      for (int o = 0; o < vectors; ++o) {
        const std::size_t at = row + static_cast<std::size_t>(o * kLanes);
        const Float8 zero{};
        Float8 u, pull, x;
        load(u, v.u + at);
        load(pull, v.residual + at);
        if (v.f != nullptr) {
          load(x, v.f + at);
          pull += x;
        }
        // A bound pushes against the pull of links and loads.
        Float8 force{};
        if (v.lower != nullptr) {
          load(x, v.lower + at);
          force = ((u <= x) & (pull < zero)) ? -pull : force;
        }
        if (v.negated_upper != nullptr) {
          load(x, v.negated_upper + at);
          force = ((u >= -x) & (pull > zero)) ? -pull : force;
        }
        load(x, v.inverse_diagonal + at);
        force = x > zero ? force : zero;
        if (crosses) {
          load(x, uncovered.data() + o * kLanes);
          force *= x;
        }
        of_row += force;
      }
      for (int lane = 0; lane < kLanes; ++lane) sum += static_cast<double>(of_row[lane]);
    }
  }
  return sum;
}

}  // namespace voxel::composite
