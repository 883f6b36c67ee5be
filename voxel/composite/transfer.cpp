// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/composite/transfer.h"

namespace voxel::composite {
namespace {

// Lanes of a row between those of a coarse one: the lane before each, and the one after.
HYBRID_INLINE void spread(const Octet& row, bool odd, Octet& before, Octet& after) {
  if (odd) {
    before = __builtin_shufflevector(row, row, 0, 1, 1, 2, 2, 3, 3, 4);
    after = __builtin_shufflevector(row, row, 1, 2, 2, 3, 3, 4, 4, 5);
  } else {
    before = __builtin_shufflevector(row, row, 0, 0, 1, 1, 2, 2, 3, 3);
    after = __builtin_shufflevector(row, row, 1, 1, 2, 2, 3, 3, 4, 4);
  }
}

// How far a node between two is towards the second: half way where it has not both links.
HYBRID_INLINE void part_between(const Octet& link_before, const Octet& link_after, Octet& part) {
  const Octet zero{}, half = zero + 0.5F, one = zero + 1.0F;
  const OctetMask both = (link_before > zero) & (link_after > zero);
  Octet sum = link_before + link_after;
  sum = both ? sum : one;
  part = link_after / sum;
  part = both ? part : half;
}
HYBRID_INLINE void part_between(const std::array<const float*, 2>& links, int at, Octet& part) {
  Octet before{}, after{};
  if (links[0] != nullptr) load(before, links[0] + at);
  if (links[1] != nullptr) load(after, links[1] + at);
  part_between(before, after, part);
}

HYBRID_INLINE void finish(const ProlongArgs& t, int at, Octet& x) {
  Octet own;
  load(own, t.u + at);
  if (t.adds) {
    Octet is_free;
    load(is_free, t.is_free + at);
    x = own + is_free * x;
  }
  if (t.least != nullptr) {
    Octet low;
    load(low, t.least + at);
    x = x > low ? x : low;
  }
  if (t.most_negative != nullptr) {
    Octet high;
    load(high, t.most_negative + at);
    high = -high;
    x = x < high ? x : high;
  }
  store(t.u + at, x);
}

}  // namespace

HYBRID_WIDE void prolong_row(const ProlongArgs& t) noexcept {
  for (int o = 0; o < t.octets; ++o) {
    Octet sum{};
    for (int n = 0; n < t.count; ++n) {
      Octet row;
      load(row, t.rows[static_cast<std::size_t>(n)] + (kOctet / 2) * o);
      sum += t.weights[static_cast<std::size_t>(n)] * row;
    }
    Octet before, after;
    spread(sum, t.odd, before, after);
    const int at = o * kOctet;
    Octet part;
    load(part, t.along + at);
    Octet x = before + part * (after - before);
    finish(t, at, x);
  }
}

HYBRID_WIDE void prolong_row_by_links(const ProlongArgs& t, const ProlongByLinksArgs& by) noexcept {
  for (int o = 0; o < t.octets; ++o) {
    const int at = o * kOctet;
    Octet along;
    load(along, t.along + at);
    const auto row = [&](std::size_t n, Octet & x) __attribute__((always_inline)) {
      Octet coarse, before, after, part = Octet{} + 0.5F;
      load(coarse, by.rows[n] + (kOctet / 2) * o);
      spread(coarse, t.odd, before, after);
      if (by.along_x[n] != nullptr) part_between({by.along_x[n] - 1, by.along_x[n]}, at, part);
      const OctetMask between = along == Octet{} + 0.5F;
      part = between ? part : along;
      x = before + part * (after - before);
    };
    const auto in_plane = [&](std::size_t z, Octet & x) __attribute__((always_inline)) {
      row(2 * z, x);
      if (!by.between_y) return;
      Octet after, part;
      row(2 * z + 1, after);
      part_between(by.along_y[z], at, part);
      x += part * (after - x);
    };
    Octet x;
    in_plane(0, x);
    if (by.between_z) {
      Octet after, part;
      in_plane(1, after);
      part_between(by.along_z, at, part);
      x += part * (after - x);
    }
    finish(t, at, x);
  }
}

HYBRID_WIDE void restrict_row_by_links(const RestrictArgs& g) noexcept {
  for (int o = 0; o < g.octets; ++o) {
    const int at = o * kOctet;
    // Of a row before it is the second of the two that one stands between.
    const auto share = [&](float whole, std::size_t n, const std::array<const float*, 2>& links, Octet& w)
        __attribute__((always_inline)) {
      w = Octet{} + whole;
      if (n == 1 || whole != 0.5F) return;
      part_between(links, at, w);
      if (n == 2) w = Octet{} + 1.0F - w;
    };
    Octet sum{};
    for (std::size_t y = 0; y < 3; ++y) {
      if (g.share_y[y] == 0.0F) continue;
      Octet of_y{}, w;
      for (std::size_t z = 0; z < 3; ++z) {
        if (g.rows[z][y] == nullptr || g.share_z[z] == 0.0F) continue;
        Octet x;
        load(x, g.rows[z][y] + at);
        share(g.share_z[z], z, g.along_z[z][y], w);
        of_y += w * x;
      }
      share(g.share_y[y], y, g.along_y[y], w);
      sum += w * of_y;
    }
    store(g.sum + at, sum);
    Octet part = Octet{} + 0.5F;
    if (g.along_x != nullptr) part_between({g.along_x - 1, g.along_x}, at, part);
    store(g.part + at, part);
  }
}

}  // namespace voxel::composite
