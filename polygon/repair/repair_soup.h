// SPDX-License-Identifier: GPL-3.0-or-later
// What the first half of a repair works on: a soup whose vertices are all different.
#pragma once

#include <cstdint>
#include <vector>

#include "polygon/mesh/findings.h"
#include "polygon/mesh/mesh.h"

namespace polygon {

struct RepairSoup {
  static constexpr std::uint32_t kFilled = 0xffffffffU;

  TriangleMesh mesh;                  // no two vertices equal, no triangle with two equal corners
  std::vector<std::uint32_t> number;  // one a triangle: its number in the mesh as given, or kFilled
};

// Borders that lie within `tolerance_m` of one another, edge by edge, become one: of the vertices that meet
// the one named first stays where it is. Nothing is moved unless two border edges become one edge by it, no
// triangle loses its area, and no edge gets a third triangle; where it is not clear which edge belongs to
// which, the crack stays.
struct ClosedCracks {
  Found edges;               // pairs of border edges that became one
  std::size_t vertices = 0;  // moved
  double furthest_m = 0.0;   // that any of them moved
};
ClosedCracks close_cracks(RepairSoup& soup, double tolerance_m);

// Small holes (see RepairOptions) are filled with triangles between the vertices that are there.
struct FilledHoles {
  Found filled;
  std::size_t triangles = 0;  // added
  Found left;                 // the place first said is the longest's; why, one count a reason:
  std::size_t long_ones = 0, large_ones = 0, branching = 0, unfillable = 0;
};
FilledHoles fill_holes(RepairSoup& soup, std::size_t most_edges, double most_share);

}  // namespace polygon
