// SPDX-License-Identifier: GPL-3.0-or-later
// The soup that the first half of a repair works on (close_cracks.cpp, fill_holes.cpp). Its vertices are all
// different.
#pragma once

#include <cstdint>
#include <vector>

#include "polygon/mesh/findings.h"
#include "polygon/mesh/mesh.h"
#include "polygon/repair/check.h"

namespace polygon {

struct RepairSoup {
  static constexpr std::uint32_t kFilled = 0xffffffffU;

  TriangleMesh mesh;                  // no two vertices equal, no triangle with two equal corners
  std::vector<std::uint32_t> number;  // [triangle] its index in the mesh as given, or kFilled
};

// Merges borders that run within `tolerance_m` of one another, edge by edge. Of merged vertices the one with
// the lowest index keeps its place. A vertex moves only if two border edges become one, no triangle becomes
// degenerate and no edge gets a third triangle. Where the pairing of edges is ambiguous, the crack stays.
struct ClosedCracks {
  FindingTally edges;        // pairs of border edges that were joined
  std::size_t vertices = 0;  // number that moved
  double furthest_m = 0.0;   // longest move
};
ClosedCracks close_cracks(RepairSoup& soup, double tolerance_m);

// Fills small holes (RepairOptions) with triangles between existing vertices. No triangle and no inner edge
// of a fill is one that is there already.
struct FilledHoles {
  FindingTally filled;
  std::size_t triangles = 0;  // added
  std::size_t untried = 0;    // holes that were left because the bound on the work was reached
};
FilledHoles fill_holes(RepairSoup& soup, const RepairOptions& options);

// The rims of a repaired mesh, as a check counts them, by the reason why they are left.
struct HolesLeft {
  FindingTally left;  // its place is that of the longest
  std::size_t too_long = 0, too_large = 0, branching = 0, unfillable = 0;
};
HolesLeft holes_left(const TriangleMesh& mesh, const RepairOptions& options);

}  // namespace polygon
