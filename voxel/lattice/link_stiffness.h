// SPDX-License-Identifier: GPL-3.0-or-later
// The six-link energy: spring stiffness of a link.
//
// A link along d of length h_d has a spring of E·A/h_d along it and of G·A/h_d across it, where A is the
// product of the two other spacings. A voxel is a node. So an object ends at the centres of its outermost
// voxels, and so does a region of stiffer tissue within it. Around a link lie four cells of eight voxels, and
// the link stands for a quarter of each. E and G are the means of the four quarters; a quarter is 0 if its
// cell lacks a voxel.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace voxel {

// With moduli E along its links and G across them, a lattice pressed on a face obeys an anisotropic Laplace
// equation. Its half-space has the contact modulus 2·sqrt(E·G). This G makes that modulus E/(1−ν²), the
// contact modulus of an elastic half-space and the only modulus in the solutions for Hertz's ball and the
// flat punch.
[[nodiscard]] constexpr double across_modulus_Pa(double young_Pa, double poisson) {
  const double plane = 1.0 - poisson * poisson;
  return young_Pa / (4.0 * plane * plane);
}

// A link a→b has nine parallels a+s → b+s. s = (p, q) is an offset in the two directions across the link,
// each −1, 0 or 1. The parallel at (p, q) has number (p+1) + 3(q+1); the link itself is number 4. p and q may
// be swapped.
inline constexpr std::size_t kLinkItself = 4;

// Share of the area that a link stands for, 0 < w <= 1. Bit n of `parallels` is set if link n exists (both of
// its ends are filled); bit 4 is taken as set.
//
// The share is 1 inside, 1/2 on a face, 1/4 on an edge, 3/4 along a notch. On a flat surface the stiffness
// for a wave is then second-order accurate in the spacing. With whole links at the border it would be
// first-order accurate. A direction without a neighbour on either side does not reduce the share. So a sheet
// one voxel thick keeps the thickness of its voxels, and a row of voxels keeps its whole area.
[[nodiscard]] constexpr double link_weight(std::uint32_t parallels) {
  const auto there = [parallels](int p, int q) { return (parallels >> (p + 1 + 3 * (q + 1)) & 1U) != 0; };
  int quarters = 0;
  for (const int p : {-1, 1}) {
    for (const int q : {-1, 1}) quarters += there(p, 0) && there(0, q) && there(p, q) ? 1 : 0;
  }
  if (quarters > 0) return 0.25 * quarters;
  const auto share = [](bool low, bool high) { return low != high ? 0.5 : 1.0; };
  return share(there(-1, 0), there(1, 0)) * share(there(0, -1), there(0, 1));
}

// Parallels of the link of a voxel in direction +d. Bit (x+1) + 3(y+1) + 9(z+1) of `filled` is set if the
// voxel at offset (x, y, z) exists; x, y and z are −1, 0 or 1.
[[nodiscard]] constexpr std::uint32_t parallel_links(std::uint32_t filled, int d) {
  constexpr std::array<int, 3> kStep{1, 3, 9};  // from a bit of `filled` to the next one along x, y, z
  const int along = kStep[static_cast<std::size_t>(d)];
  const int across_p = kStep[static_cast<std::size_t>((d + 1) % 3)],
            across_q = kStep[static_cast<std::size_t>((d + 2) % 3)];
  std::uint32_t out = 0;
  for (int q = -1; q <= 1; ++q) {
    for (int p = -1; p <= 1; ++p) {
      const int cell = 13 + p * across_p + q * across_q;
      out |= (filled >> cell & filled >> (cell + along) & 1U) << (p + 1 + 3 * (q + 1));
    }
  }
  return out;
}

struct LinkModuli {
  double along_Pa = 0.0, across_Pa = 0.0;  // both 0 if there is no link
};

[[nodiscard]] constexpr LinkModuli softer(const LinkModuli& a, const LinkModuli& b) {
  return b.along_Pa < a.along_Pa ? b : a;
}

// Moduli of a link where materials meet, as a sum of two parts. `links[n]` contains the moduli of the softer
// of the two ends of parallel n; 0 if an end is missing. In one material the sum is the material's moduli
// times link_weight.
struct LinkParts {
  // Mean of the four quarters; a quarter has the moduli of the softest voxel of its cell. A rule by the
  // link's two ends in series would ignore the voxels beside the link.
  LinkModuli cells;
  // Excess stiffness of a sheet or row of voxels too thin to fill a cell, as if it were in air. Without this
  // part, thin skin in fat would have no stiffness of its own. 0 if a quarter is as stiff as the link.
  LinkModuli thin;
};

[[nodiscard]] constexpr LinkParts link_parts(const std::array<LinkModuli, 9>& links) {
  const LinkModuli& own = links[kLinkItself];
  LinkParts out;
  bool thick = false;
  for (const std::size_t p : {3U, 5U}) {
    for (const std::size_t q : {1U, 7U}) {
      const LinkModuli quarter = softer(softer(own, links[p]), softer(links[q], links[p + q - kLinkItself]));
      out.cells.along_Pa += 0.25 * quarter.along_Pa;
      out.cells.across_Pa += 0.25 * quarter.across_Pa;
      thick = thick || quarter.along_Pa >= own.along_Pa;
    }
  }
  if (thick) return out;
  std::uint32_t as_stiff = 0;
  for (std::size_t n = 0; n < 9; ++n) as_stiff |= (links[n].along_Pa >= own.along_Pa ? 1U : 0U) << n;
  const double weight = link_weight(as_stiff);
  out.thin = {weight * (own.along_Pa - out.cells.along_Pa), weight * (own.across_Pa - out.cells.across_Pa)};
  return out;
}

// Moduli for the springs of the six-link energy.
[[nodiscard]] constexpr LinkModuli link_moduli(const std::array<LinkModuli, 9>& links) {
  const LinkParts parts = link_parts(links);
  return {parts.cells.along_Pa + parts.thin.along_Pa, parts.cells.across_Pa + parts.thin.across_Pa};
}

// Moduli for the springs beside the bricks of the accurate energy (voxel/fem/hex_element.h). Bricks replace
// the cells. Tissue too thin for a brick keeps its links. Bricks and links act on the same voxels.
[[nodiscard]] constexpr LinkModuli link_moduli_beside_bricks(const std::array<LinkModuli, 9>& links) {
  return link_parts(links).thin;
}

}  // namespace voxel
