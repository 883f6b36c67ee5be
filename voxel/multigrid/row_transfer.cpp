// SPDX-License-Identifier: GPL-3.0-or-later
// Between levels.
#include <array>

#include "voxel/multigrid/row_stencil.h"
#include "voxel/multigrid/row_smoother.h"
#include "voxel/lattice/simd_dispatch.h"

namespace voxel {

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

HYBRID_WIDE_AND_MANY void take_untold(const float* value, float* told, const float* filled, OctetSpan span,
                                      int first, int last, float* out) noexcept {
  constexpr OctetMask kLane{0, 1, 2, 3, 4, 5, 6, 7};
#pragma GCC unroll 1
  for (int octet = span.first; octet <= span.last; ++octet) {
    const int lane = octet * kOctet;
    const OctetMask at = kLane + lane;
    const OctetMask tells = (at >= first) & (at <= last);
    Octet v, t, f;
    load(v, value + lane);
    load(t, told + lane);
    load(f, filled + lane);
    f *= v - t;
    store(out + (octet - span.first) * kOctet, tells ? f : Octet{});
    store(told + lane, tells ? v : t);
  }
}

HYBRID_WIDE_AND_MANY void spread_along(const float* cells, int octets, float* lanes) noexcept {
  Octet before, own, after;
  load(before, cells - kOctet);
  load(own, cells);
#pragma GCC unroll 1
  for (int m = 0; m < octets; ++m) {
    load(after, cells + (m + 1) * kOctet);
    const Octet low = 0.75F * __builtin_shufflevector(own, own, 0, 0, 1, 1, 2, 2, 3, 3) +
                      0.25F * __builtin_shufflevector(own, before, 15, 1, 0, 2, 1, 3, 2, 4);
    const Octet high = 0.75F * __builtin_shufflevector(own, own, 4, 4, 5, 5, 6, 6, 7, 7) +
                       0.25F * __builtin_shufflevector(own, after, 3, 5, 4, 6, 5, 7, 6, 8);
    store(lanes + 2 * m * kOctet, low);
    store(lanes + (2 * m + 1) * kOctet, high);
    before = own;
    own = after;
  }
}

HYBRID_WIDE_AND_MANY bool all_ones(const float* lanes, int octets) noexcept {
  OctetMask other{};
#pragma GCC unroll 1
  for (int m = 0; m < octets; ++m) {
    Octet x;
    load(x, lanes + m * kOctet);
    other |= x != 1.0F;
  }
  return !any(other);
}

HYBRID_WIDE_AND_MANY void sum_hats(const std::array<HatRow, 4>& rows, OctetSpan span,
                                   RowVector& out) noexcept {
  static constexpr std::array<float, 4> kShare{0.5625F, 0.1875F, 0.1875F, 0.0625F};
  bool whole = true;
  for (const HatRow& r : rows) whole = whole && r.weight == nullptr;
#pragma GCC unroll 1
  for (int octet = span.first; octet <= span.last; ++octet) {
    const int lane = (octet - span.first) * kOctet;
    std::array<Octet, 3> sum{};
    Octet weight{};
#pragma GCC unroll 1
    for (std::size_t n = 0; n < 4; ++n) {
      const HatRow& r = rows[n];
      if (!whole) {
        Octet w = Octet{} + 1.0F;
        if (r.weight != nullptr) load(w, r.weight + lane);
        weight += kShare[n] * w;
      }
      if (!r.tells) continue;
#pragma GCC unroll 3
      for (std::size_t axis = 0; axis < 3; ++axis) {
        Octet x;
        load(x, r.sum[axis] + lane);
        sum[axis] += kShare[n] * x;
      }
    }
    if (!whole) {
      const Octet inverse = weight > 0.0F ? (Octet{} + 1.0F) / weight : Octet{};
      for (std::size_t axis = 0; axis < 3; ++axis) sum[axis] *= inverse;
    }
#pragma GCC unroll 3
    for (std::size_t axis = 0; axis < 3; ++axis) store(out[axis].data() + octet * kOctet, sum[axis]);
  }
}

HYBRID_WIDE_AND_MANY void take_back(const RowVector& sums, const float* share,
                                    const std::array<float*, 3>& value, const std::array<float*, 3>& told,
                                    OctetSpan span) noexcept {
#pragma GCC unroll 1
  for (std::size_t axis = 0; axis < 3; ++axis) {
#pragma GCC unroll 1
    for (int octet = span.first; octet <= span.last; ++octet) {
      Octet mean, part, x;
      load(mean, sums[axis].data() + octet * kOctet);
      load(part, share + octet * kOctet);
      mean *= part;
      load(x, value[axis] + octet * kOctet);
      store(value[axis] + octet * kOctet, x - mean);
      load(x, told[axis] + octet * kOctet);
      store(told[axis] + octet * kOctet, x - mean);
    }
  }
}

HYBRID_WIDE_AND_MANY float row_difference(const float* a, const float* b, OctetSpan span, int first,
                                          int last) noexcept {
  constexpr OctetMask kLane{0, 1, 2, 3, 4, 5, 6, 7};
  Octet most{}, x, y;
#pragma GCC unroll 1
  for (int octet = span.first; octet <= span.last; ++octet) {
    load(x, a + octet * kOctet);
    load(y, b + octet * kOctet);
    const OctetMask at = kLane + octet * kOctet;
    x -= y;
    x = ((at >= first) & (at <= last)) ? x : Octet{};
    take_largest_size(most, x);
  }
  return largest(most);
}

HYBRID_WIDE float row_way(const float* now, const float* was, float* way) noexcept {
  Octet most{};
#pragma GCC unroll 4
  for (int octet = 0; octet < kOctets; ++octet) {
    Octet is, before;
    load(is, now + octet * kOctet);
    load(before, was + octet * kOctet);
    is -= before;
    store(way + octet * kOctet, is);
    take_largest_size(most, is);
  }
  return largest(most);
}

}  // namespace voxel
