// SPDX-License-Identifier: GPL-3.0-or-later
// Between levels.
#include <array>

#include "voxel/sparse/row_axes.h"
#include "voxel/sparse/row_passes.h"
#include "voxel/wide.h"

namespace voxel::sparse {

HYBRID_WIDE_AND_MANY void add_pairs(const float* fine, OctetSpan span, float* half) noexcept {
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

HYBRID_WIDE_AND_MANY void take_means(const RowVector& sums, const float* share,
                                     const std::array<float*, 3>& value, const std::array<float*, 3>& told,
                                     OctetSpan span) noexcept {
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

HYBRID_WIDE_AND_MANY void take_loads(const LevelRow& row, const RowVector& force,
                                     const std::array<float*, 3>& to, OctetSpan span) noexcept {
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

HYBRID_WIDE_AND_MANY void interpolate_row(const CoarseRows& c, OctetSpan span, RowVector& out) noexcept {
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

HYBRID_WIDE_AND_MANY float row_difference(const float* a, const float* b, OctetSpan span) noexcept {
  Octet most{}, x, y;
#pragma GCC unroll 1
  for (int octet = span.first; octet <= span.last; ++octet) {
    load(x, a + octet * kOctet);
    load(y, b + octet * kOctet);
    take_largest_size(most, x - y);
  }
  return largest(most);
}

}  // namespace voxel::sparse
