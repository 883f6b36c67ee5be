// SPDX-License-Identifier: GPL-3.0-or-later
// Bounds of nodes and multipliers of links (row_kernels.h), one level array at a time.
#include <algorithm>

#include "voxel/composite/row_kernels.h"

namespace voxel::composite {
namespace {

// Range of the factor by which one cycle may change the weight of a link at its limit.
constexpr float kMaxCycleFactor = 2.0F, kMinCycleFactor = 0.25F;

}  // namespace

// Nodes at a bound must move with it before the cycle. In a tight cone nodes are pulled only where its planes
// meet, so smoothing alone would move the cone by one node a sweep. A node that its bound has passed is moved
// onto the bound.
HYBRID_WIDE void follow_bounds(float* u, const float* at_bound, const float* lower,
                               const float* negated_upper, std::size_t count) noexcept {
  for (std::size_t n = 0; n < count; n += kOctet) {
    Octet x, h;
    load(x, u + n);
    load(h, at_bound + n);
    const Octet none = Octet{} + 0.5F * kNoBound, zero{};
    if (lower != nullptr) {
      Octet low;
      load(low, lower + n);
      x = (((h > zero) & (low > none)) | (low > x)) ? low : x;
    }
    if (negated_upper != nullptr) {
      Octet high;
      load(high, negated_upper + n);
      high = -high;
      x = (((h < zero) & (high < -none)) | (high < x)) ? high : x;
    }
    store(u + n, x);
  }
}

HYBRID_WIDE void note_at_bound(float* at_bound, const float* u, const float* lower,
                               const float* negated_upper, std::size_t count) noexcept {
  for (std::size_t n = 0; n < count; n += kOctet) {
    Octet x, bound;
    load(x, u + n);
    const Octet one = Octet{} + 1.0F;
    Octet h{};
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

HYBRID_WIDE float largest_limit_ratio(const float* u, const float* weight, std::size_t by,
                                      const LinkMultiplier& limit, std::size_t count) noexcept {
  Octet most{};
  const Octet zero{};
  for (std::size_t n = 0; n < count; n += kOctet) {
    Octet own, next, g;
    load(own, u + n);
    load(next, u + n + by);
    load(g, weight + n);
    const Octet longer = next - own, of_high = limit.per_longer * longer,
                of_low = -limit.per_shorter * longer;
    Octet of = of_high > of_low ? of_high : of_low;
    of = g > zero ? of : zero;
    take_largest(most, of);
  }
  float result = 0.0F;
  for (int lane = 0; lane < kOctet; ++lane) result = most[lane] > result ? most[lane] : result;
  return result;
}

HYBRID_WIDE float update_row_weights(const float* u, const float* weight, std::size_t by,
                                     const LinkMultiplier& limit, float* limited,
                                     std::size_t count) noexcept {
  Octet most{};
  const Octet zero{}, one = zero + 1.0F;
  const float above = 1.0F + limit.tolerance, below = 1.0F - limit.tolerance;
  for (std::size_t n = 0; n < count; n += kOctet) {
    Octet own, next, g, h;
    load(own, u + n);
    load(next, u + n + by);
    load(g, weight + n);
    load(h, limited + n);
    const Octet longer = next - own, of_high = limit.per_longer * longer,
                of_low = -limit.per_shorter * longer;
    const Octet of = of_high > of_low ? of_high : of_low;
    Octet factor = of * (0.5F + 0.5F * of);
    factor = factor < kMaxCycleFactor ? factor : zero + kMaxCycleFactor;
    factor = factor > kMinCycleFactor ? factor : zero + kMinCycleFactor;
    factor = ((of > above) | (of < below)) ? factor : one;
    h *= factor;
    const Octet stiffest = limit.max_factor * g;
    h = h > g ? h : g;
    h = h < stiffest ? h : stiffest;
    store(limited + n, h);
    Octet ratio = h / g;
    ratio = g > zero ? ratio : zero;
    take_largest(most, ratio);
  }
  float result = 1.0F;
  for (int lane = 0; lane < kOctet; ++lane) result = most[lane] > result ? most[lane] : result;
  return result;
}

float updated_weight(float limited, float weight, float limit_ratio, const LinkMultiplier& limit) noexcept {
  if (limit_ratio > 1.0F + limit.tolerance || limit_ratio < 1.0F - limit.tolerance)
    limited *= std::clamp(limit_ratio * (0.5F + 0.5F * limit_ratio), kMinCycleFactor, kMaxCycleFactor);
  return std::clamp(limited, weight, limit.max_factor * weight);
}

}  // namespace voxel::composite
