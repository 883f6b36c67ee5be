// SPDX-License-Identifier: GPL-3.0-or-later
// The triangle soup on which the first half of a repair works (close_cracks.cpp, fill_holes.cpp).
#pragma once

#include <cstdint>
#include <vector>

#include "polygon/mesh/findings.h"
#include "polygon/mesh/mesh.h"
#include "polygon/repair/check.h"

namespace polygon {

struct RepairSoup {
  static constexpr std::uint32_t kFilled = 0xffffffffU;  // value in `number`: the triangle fills a hole

  TriangleMesh mesh;                  // no two vertices equal, no triangle with two equal corners
  std::vector<std::uint32_t> number;  // [triangle] index in the mesh as given, or kFilled
};

// close_cracks() merges borders that run within `tolerance_m` of one another, edge by edge. Merged vertices
// take the place of the one with the lowest index. A vertex moves only if two border edges become one, no
// triangle becomes degenerate and no edge gets a third triangle. Where the pairing of edges is ambiguous, the
// crack stays.
struct ClosedCracks {
  FindingTally edges;        // pairs of border edges that were joined
  std::size_t vertices = 0;  // number of vertices that moved
  double furthest_m = 0.0;   // longest move of a vertex
};
ClosedCracks close_cracks(RepairSoup& soup, double tolerance_m);

// fill_holes() fills small holes (RepairOptions) with triangles between existing vertices. No triangle and no
// inner edge of a fill was already in the mesh.
struct FilledHoles {
  FindingTally filled;
  std::size_t triangles = 0;  // added
  std::size_t untried = 0;    // holes that were left because the bound on the work was reached
};
FilledHoles fill_holes(RepairSoup& soup, const RepairOptions& options);

// The rims of a repaired mesh as check_mesh() counts them, by the reason why they were not filled.
struct HolesLeft {
  FindingTally left;  // its place is the longest rim
  std::size_t too_long = 0, too_large = 0, branching = 0, unfillable = 0;
};
HolesLeft holes_left(const TriangleMesh& mesh, const RepairOptions& options);

}  // namespace polygon
