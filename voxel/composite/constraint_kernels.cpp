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
HYBRID_MULTIVERSIONED void follow_bounds(float* u, const float* at_bound, const float* lower,
                                         const float* negated_upper, std::size_t count) noexcept {
  for (std::size_t n = 0; n < count; n += kLanes) {
    Float8 x, h;
    load(x, u + n);
    load(h, at_bound + n);
    const Float8 none = Float8{} + 0.5F * kNoBound, zero{};
    if (lower != nullptr) {
      Float8 low;
      load(low, lower + n);
      x = (((h > zero) & (low > none)) | (low > x)) ? low : x;
    }
    if (negated_upper != nullptr) {
      Float8 high;
      load(high, negated_upper + n);
      high = -high;
      x = (((h < zero) & (high < -none)) | (high < x)) ? high : x;
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

HYBRID_MULTIVERSIONED float largest_limit_ratio(const float* u, const float* weight, std::size_t by,
                                                const LinkMultiplier& limit, std::size_t count) noexcept {
  Float8 most{};
  const Float8 zero{};
  for (std::size_t n = 0; n < count; n += kLanes) {
    Float8 own, next, g;
    load(own, u + n);
    load(next, u + n + by);
    load(g, weight + n);
    const Float8 longer = next - own, of_high = limit.per_longer * longer,
                 of_low = -limit.per_shorter * longer;
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
    const Float8 longer = next - own, of_high = limit.per_longer * longer,
                 of_low = -limit.per_shorter * longer;
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

}  // namespace voxel::composite
