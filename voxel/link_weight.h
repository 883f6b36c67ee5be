// SPDX-License-Identifier: GPL-3.0-or-later
// The six-link energy: what a link's springs are worth.
//
// A link along d of length h_d has a spring of E·w·A/h_d along it and of G·w·A/h_d across it, A the product
// of the two other spacings. `across_modulus_Pa` gives G, `link_weight` gives w, the share of the area that
// has tissue around it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace voxel {

// Springs E along and G across make pressing on a face of the lattice an anisotropic Laplace problem, whose
// half-space feels the contact modulus 2·sqrt(E·G). This G makes it the elastic half-space's E/(1−ν²), the
// only modulus that Hertz's ball and the flat punch ask for. Rejected: the shear modulus E/(2(1+ν)), up to 46
// % off, and E/(4(1−ν²)), whose contact modulus is E/sqrt(1−ν²).
[[nodiscard]] constexpr double across_modulus_Pa(double young_Pa, double poisson) {
  const double plane = 1.0 - poisson * poisson;
  return young_Pa / (4.0 * plane * plane);
}

// Which of the eight parallels of a link a→b exist: the link from a+s to b+s is there when both ends are
// filled. p and q are the two directions across the link, in either order.
struct ParallelLinks {
  bool p_low = false, p_high = false, q_low = false, q_high = false;            // s = −p, +p, −q, +q
  bool low_low = false, high_low = false, low_high = false, high_high = false;  // s = ∓p∓q, p first
};

// Share of its area that a link stands for, 0 < w <= 1.
//
// A voxel is a node, so an object ends at the centres of its outermost voxels, and a link stands for the
// quarters of its area that lie inside: 1 within, 1/2 on a face, 1/4 on an edge, 3/4 along a notch. On a flat
// surface that makes the stiffness felt by a wave right to second order in its spacing; whole links at the
// border are right only to the first (Hertz's ball with a contact radius of 4 spacings: 8 % too much, 8
// spacings: 5 %). A direction in which neither side exists has no inside: a sheet one voxel thick keeps the
// thickness of its voxels, a row of voxels its whole area.
[[nodiscard]] constexpr double link_weight(const ParallelLinks& s) {
  const int p_sides = (s.p_low ? 1 : 0) + (s.p_high ? 1 : 0),
            q_sides = (s.q_low ? 1 : 0) + (s.q_high ? 1 : 0);
  const auto share = [](int sides) { return sides == 1 ? 0.5 : 1.0; };
  if (p_sides == 0 || q_sides == 0) return share(p_sides) * share(q_sides);
  const int quarters =
      (s.p_low && s.q_low && s.low_low ? 1 : 0) + (s.p_high && s.q_low && s.high_low ? 1 : 0) +
      (s.p_low && s.q_high && s.low_high ? 1 : 0) + (s.p_high && s.q_high && s.high_high ? 1 : 0);
  // Sheets that cross, with nothing between them.
  if (quarters == 0) return share(p_sides) * share(q_sides);
  return 0.25 * quarters;
}

// The same from what is filled around a: bit (x+1) + 3(y+1) + 9(z+1) of `around` says whether the voxel at
// offset (x, y, z), each −1, 0 or 1, is filled. The link leaves a in direction +d; b must be filled.
[[nodiscard]] constexpr double link_weight(std::uint32_t around, int d) {
  constexpr std::array<int, 3> kStep{1, 3, 9};
  const int along = kStep[static_cast<std::size_t>(d)], p = kStep[static_cast<std::size_t>((d + 1) % 3)],
            q = kStep[static_cast<std::size_t>((d + 2) % 3)];
  const auto there = [around, along](int offset) {
    const int cell = 13 + offset;
    return ((around >> cell) & 1U) != 0 && ((around >> (cell + along)) & 1U) != 0;
  };
  return link_weight(ParallelLinks{there(-p), there(p), there(-q), there(q), there(-p - q), there(p - q),
                                   there(q - p), there(p + q)});
}

}  // namespace voxel
