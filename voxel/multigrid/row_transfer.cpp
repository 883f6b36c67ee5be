// SPDX-License-Identifier: GPL-3.0-or-later
// Restriction and prolongation of a row.
#include <array>

#include "voxel/lattice/simd_dispatch.h"
#include "voxel/multigrid/row_smoother.h"
#include "voxel/multigrid/row_stencil.h"

namespace voxel {

HYBRID_MULTIVERSIONED_512 void add_pairs(const float* fine, LaneSpan span, float* half) noexcept {
#pragma GCC unroll 1
  for (int group = span.first; group < span.last; group += 2) {
    Float8 a, b, sum;
    load(a, fine + group * kLanes);
    load(b, fine + (group + 1) * kLanes);
    load(sum, half + group / 2 * kLanes);
    const Float8 even = __builtin_shufflevector(a, b, 0, 2, 4, 6, 8, 10, 12, 14),
                 odd = __builtin_shufflevector(a, b, 1, 3, 5, 7, 9, 11, 13, 15);
    sum += even + odd;
    store(half + group / 2 * kLanes, sum);
  }
}

HYBRID_MULTIVERSIONED_512 void take_means(const RowVector& sums, const float* share,
                                          const std::array<float*, 3>& value,
                                          const std::array<float*, 3>& prolonged, LaneSpan span) noexcept {
#pragma GCC unroll 1
  for (std::size_t axis = 0; axis < 3; ++axis) {
#pragma GCC unroll 1
    for (int group = span.first; group <= span.last; ++group) {
      Float8 mean, part, v, t;
      load(mean, sums[axis].data() + group * kLanes);
      load(part, share + group * kLanes);
      load(v, value[axis] + group * kLanes);
      load(t, prolonged[axis] + group * kLanes);
      mean *= part;
      store(value[axis] + group * kLanes, mean + (v - t));
      store(prolonged[axis] + group * kLanes, mean);
    }
  }
}

HYBRID_MULTIVERSIONED_512 void take_loads(const LevelRow& row, const RowVector& force,
                                          const std::array<float*, 3>& to, LaneSpan span) noexcept {
  const RowStiffness& s = row.springs;
  Axes u;
  load_axes(u, row, span);
#pragma GCC unroll 1
  for (int group = span.first; group <= span.last; ++group) {
    const auto n = static_cast<std::size_t>(group - span.first);
    const int lane = group * kLanes;
#pragma GCC unroll 3
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float* at = row.u[axis] + lane;
      const Float8 own = u[axis][n + 1];
      Float8 k, value, sum;
      shift_down(value, u[axis][n], own);
      spring_down<false>(k, s, axis, 0, group);
      sum = k * (value - own);
      shift_up(value, own, u[axis][n + 2]);
      spring_up<false>(k, s, axis, 0, group);
      sum += k * (value - own);
      for (std::size_t d = 1; d < 3; ++d) {
        const std::ptrdiff_t stride = d == 1 ? kRow : row.z;
        load(value, at - stride);
        spring_down<false>(k, s, axis, d, group);
        sum += k * (value - own);
        load(value, at + stride);
        spring_up<false>(k, s, axis, d, group);
        sum += k * (value - own);
      }
      load(value, force[axis].data() + lane);
      store(to[axis] + lane, value - sum);
    }
  }
}

HYBRID_MULTIVERSIONED_512 void take_pending_correction(const float* value, float* prolonged,
                                                       const float* filled, LaneSpan span, int first,
                                                       int last, float* out) noexcept {
  constexpr Mask8 kLane{0, 1, 2, 3, 4, 5, 6, 7};  // number of each lane
#pragma GCC unroll 1
  for (int group = span.first; group <= span.last; ++group) {
    const int lane = group * kLanes;
    const Mask8 at = kLane + lane;
    const Mask8 is_source = (at >= first) & (at <= last);
    Float8 v, t, f;
    load(v, value + lane);
    load(t, prolonged + lane);
    load(f, filled + lane);
    f *= v - t;
    store(out + (group - span.first) * kLanes, is_source ? f : Float8{});
    store(prolonged + lane, is_source ? v : t);
  }
}

HYBRID_MULTIVERSIONED_512 void spread_along(const float* cells, int groups, float* lanes) noexcept {
  Float8 before, own, after;
  load(before, cells - kLanes);
  load(own, cells);
#pragma GCC unroll 1
  for (int m = 0; m < groups; ++m) {
    load(after, cells + (m + 1) * kLanes);
    const Float8 low = 0.75F * __builtin_shufflevector(own, own, 0, 0, 1, 1, 2, 2, 3, 3) +
                       0.25F * __builtin_shufflevector(own, before, 15, 1, 0, 2, 1, 3, 2, 4);
    const Float8 high = 0.75F * __builtin_shufflevector(own, own, 4, 4, 5, 5, 6, 6, 7, 7) +
                        0.25F * __builtin_shufflevector(own, after, 3, 5, 4, 6, 5, 7, 6, 8);
    store(lanes + 2 * m * kLanes, low);
    store(lanes + (2 * m + 1) * kLanes, high);
    before = own;
    own = after;
  }
}

HYBRID_MULTIVERSIONED_512 bool all_ones(const float* lanes, int groups) noexcept {
  Mask8 other{};
#pragma GCC unroll 1
  for (int m = 0; m < groups; ++m) {
    Float8 x;
    load(x, lanes + m * kLanes);
    other |= x != 1.0F;
  }
  return !any(other);
}

HYBRID_MULTIVERSIONED_512 void sum_interpolated(const std::array<ProlongedRow, 4>& rows, LaneSpan span,
                                                RowVector& out) noexcept {
  // Trilinear weights: (3/4)², 3/4 · 1/4, 1/4 · 3/4, (1/4)². The rows hold their interpolation along x.
  static constexpr std::array<float, 4> kShare{0.5625F, 0.1875F, 0.1875F, 0.0625F};
  bool whole = true;
  for (const ProlongedRow& r : rows) whole = whole && r.weight == nullptr;
#pragma GCC unroll 1
  for (int group = span.first; group <= span.last; ++group) {
    const int lane = (group - span.first) * kLanes;
    std::array<Float8, 3> sum{};
    Float8 weight{};
#pragma GCC unroll 1
    for (std::size_t n = 0; n < 4; ++n) {
      const ProlongedRow& r = rows[n];
      if (!whole) {
        Float8 w = Float8{} + 1.0F;
        if (r.weight != nullptr) load(w, r.weight + lane);
        weight += kShare[n] * w;
      }
      if (!r.is_source) continue;
#pragma GCC unroll 3
      for (std::size_t axis = 0; axis < 3; ++axis) {
        Float8 x;
        load(x, r.sum[axis] + lane);
        sum[axis] += kShare[n] * x;
      }
    }
    if (!whole) {
      const Float8 inverse = weight > 0.0F ? (Float8{} + 1.0F) / weight : Float8{};
      for (std::size_t axis = 0; axis < 3; ++axis) sum[axis] *= inverse;
    }
#pragma GCC unroll 3
    for (std::size_t axis = 0; axis < 3; ++axis) store(out[axis].data() + group * kLanes, sum[axis]);
  }
}

HYBRID_MULTIVERSIONED_512 void take_back(const RowVector& sums, const float* share,
                                         const std::array<float*, 3>& value,
                                         const std::array<float*, 3>& prolonged, LaneSpan span) noexcept {
#pragma GCC unroll 1
  for (std::size_t axis = 0; axis < 3; ++axis) {
#pragma GCC unroll 1
    for (int group = span.first; group <= span.last; ++group) {
      Float8 mean, part, x;
      load(mean, sums[axis].data() + group * kLanes);
      load(part, share + group * kLanes);
      mean *= part;
      load(x, value[axis] + group * kLanes);
      store(value[axis] + group * kLanes, x - mean);
      load(x, prolonged[axis] + group * kLanes);
      store(prolonged[axis] + group * kLanes, x - mean);
    }
  }
}

HYBRID_MULTIVERSIONED_512 float row_difference(const float* a, const float* b, LaneSpan span, int first,
                                               int last) noexcept {
  constexpr Mask8 kLane{0, 1, 2, 3, 4, 5, 6, 7};  // number of each lane
  Float8 most{}, x, y;
#pragma GCC unroll 1
  for (int group = span.first; group <= span.last; ++group) {
    load(x, a + group * kLanes);
    load(y, b + group * kLanes);
    const Mask8 at = kLane + group * kLanes;
    x -= y;
    x = ((at >= first) & (at <= last)) ? x : Float8{};
    take_largest_size(most, x);
  }
  return largest(most);
}

HYBRID_MULTIVERSIONED float row_way(const float* now, const float* was, float* way) noexcept {
  Float8 most{};
#pragma GCC unroll 4
  for (int group = 0; group < kLaneGroups; ++group) {
    Float8 is, before;
    load(is, now + group * kLanes);
    load(before, was + group * kLanes);
    is -= before;
    store(way + group * kLanes, is);
    take_largest_size(most, is);
  }
  return largest(most);
}

}  // namespace voxel
