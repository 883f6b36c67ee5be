// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/composite/transfer.h"

namespace voxel::composite {
namespace {

// Coarse lanes before and after each of 8 fine lanes.
HYBRID_INLINE void coarse_neighbours(const Float8& row, bool odd, Float8& before, Float8& after) {
  if (odd) {
    before = __builtin_shufflevector(row, row, 0, 1, 1, 2, 2, 3, 3, 4);
    after = __builtin_shufflevector(row, row, 1, 2, 2, 3, 3, 4, 4, 5);
  } else {
    before = __builtin_shufflevector(row, row, 0, 0, 1, 1, 2, 2, 3, 3);
    after = __builtin_shufflevector(row, row, 1, 1, 2, 2, 3, 3, 4, 4);
  }
}

// Weight of the second of two coarse nodes at the fine node between them: the share of the second link in the
// stiffness of both links; one half if a link is missing.
HYBRID_INLINE void upper_share_between(const Float8& link_before, const Float8& link_after, Float8& part) {
  const Float8 zero{}, half = zero + 0.5F, one = zero + 1.0F;
  const Mask8 both = (link_before > zero) & (link_after > zero);
  Float8 sum = link_before + link_after;
  sum = both ? sum : one;
  part = link_after / sum;
  part = both ? part : half;
}
HYBRID_INLINE void upper_share_between(const std::array<const float*, 2>& links, int at, Float8& part) {
  Float8 before{}, after{};
  if (links[0] != nullptr) load(before, links[0] + at);
  if (links[1] != nullptr) load(after, links[1] + at);
  upper_share_between(before, after, part);
}

HYBRID_INLINE void finish(const ProlongArgs& t, int at, Float8& x) {
  Float8 own;
  load(own, t.u + at);
  if (t.adds) {
    Float8 is_free;
    load(is_free, t.is_free + at);
    x = own + is_free * x;
  }
  if (t.lower != nullptr) {
    Float8 low;
    load(low, t.lower + at);
    x = x > low ? x : low;
  }
  if (t.negated_upper != nullptr) {
    Float8 high;
    load(high, t.negated_upper + at);
    high = -high;
    x = x < high ? x : high;
  }
  store(t.u + at, x);
}

}  // namespace

HYBRID_MULTIVERSIONED void prolong_row(const ProlongArgs& t) noexcept {
  for (int o = 0; o < t.vectors; ++o) {
    Float8 sum{};
    for (int n = 0; n < t.count; ++n) {
      Float8 row;
      load(row, t.rows[static_cast<std::size_t>(n)] + (kLanes / 2) * o);
      sum += t.weights[static_cast<std::size_t>(n)] * row;
    }
    Float8 before, after;
    coarse_neighbours(sum, t.odd, before, after);
    const int at = o * kLanes;
    Float8 part;
    load(part, t.lane_weight + at);
    Float8 x = before + part * (after - before);
    finish(t, at, x);
  }
}

HYBRID_MULTIVERSIONED void prolong_row_by_links(const ProlongArgs& t, const ProlongByLinksArgs& by) noexcept {
  for (int o = 0; o < t.vectors; ++o) {
    const int at = o * kLanes;
    Float8 lane_weight;
    load(lane_weight, t.lane_weight + at);
    const auto row = [&](std::size_t n, Float8 & x) __attribute__((always_inline)) {
      Float8 coarse, before, after, part = Float8{} + 0.5F;
      load(coarse, by.rows[n] + (kLanes / 2) * o);
      coarse_neighbours(coarse, t.odd, before, after);
      if (by.link_x[n] != nullptr) upper_share_between({by.link_x[n] - 1, by.link_x[n]}, at, part);
      const Mask8 between = lane_weight == Float8{} + 0.5F;
      part = between ? part : lane_weight;
      x = before + part * (after - before);
    };
    const auto in_plane = [&](std::size_t z, Float8 & x) __attribute__((always_inline)) {
      row(2 * z, x);
      if (!by.between_y) return;
      Float8 after, part;
      row(2 * z + 1, after);
      upper_share_between(by.link_y[z], at, part);
      x += part * (after - x);
    };
    Float8 x;
    in_plane(0, x);
    if (by.between_z) {
      Float8 after, part;
      in_plane(1, after);
      upper_share_between(by.link_z, at, part);
      x += part * (after - x);
    }
    finish(t, at, x);
  }
}

HYBRID_MULTIVERSIONED void restrict_row_by_links(const RestrictArgs& g) noexcept {
  for (int o = 0; o < g.vectors; ++o) {
    const int at = o * kLanes;
    // Share of fine row n that the coarse row receives. The fine row before the coarse row (n = 0) lies
    // between two coarse rows, of which the coarse row is the second.
    const auto weight_of = [&](float whole, std::size_t n, const std::array<const float*, 2>& links,
                               Float8& w) __attribute__((always_inline)) {
      w = Float8{} + whole;
      if (n == 1 || whole != 0.5F) return;
      upper_share_between(links, at, w);
      if (n == 2) w = Float8{} + 1.0F - w;
    };
    Float8 sum{};
    for (std::size_t y = 0; y < 3; ++y) {
      if (g.share_y[y] == 0.0F) continue;
      Float8 sum_z{}, w;
      for (std::size_t z = 0; z < 3; ++z) {
        if (g.rows[z][y] == nullptr || g.share_z[z] == 0.0F) continue;
        Float8 x;
        load(x, g.rows[z][y] + at);
        weight_of(g.share_z[z], z, g.link_z[z][y], w);
        sum_z += w * x;
      }
      weight_of(g.share_y[y], y, g.link_y[y], w);
      sum += w * sum_z;
    }
    store(g.sum + at, sum);
    Float8 part = Float8{} + 0.5F;
    if (g.link_x != nullptr) upper_share_between({g.link_x - 1, g.link_x}, at, part);
    store(g.upper_share + at, part);
  }
}

}  // namespace voxel::composite
