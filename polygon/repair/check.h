// SPDX-License-Identifier: GPL-3.0-or-later
// Numbered checks of a mesh, and its repair. README.md lists the findings and the defects that people must
// mend. Anything beyond counting uses CGAL: exact predicates (self_intersections.cpp) and polygon mesh
// processing (repair.cpp).
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "polygon/mesh/mesh.h"

namespace polygon {

struct MeshCheck {
  std::vector<Finding> findings;  // from cheap to expensive checks, each with a count and a place
  bool closed = false;            // every edge has exactly two triangles, after welding
  bool oriented = false;          // closed, consistently oriented and outward (positive volume)
  double volume_m3 = 0.0;         // signed; 0 unless closed and consistently oriented
  // Edges of one triangle, of more than two, and run through in one direction by two.
  std::size_t border_edges = 0, nonmanifold_edges = 0, turned_edges = 0;
};

// "a closed solid", or "a two-sided sheet" and why: how the mesh is touched.
[[nodiscard]] std::string touched_as(const MeshCheck& check);

// `deep` also searches for self-intersections (seconds for a million triangles).
MeshCheck check_mesh(const TriangleMesh& mesh, bool deep = false);

struct RepairOptions {
  // Border vertices within this fraction of the mesh's diagonal are merged, if that joins two border edges
  // and changes nothing else. Exporters that round to six digits need 1e-6.
  double crack_share = 1e-6;
  // A hole is small, and is filled, if its loop has at most `hole_edges` edges and the diagonal of the loop's
  // box is at most `hole_share` of the diagonal of its piece's box. The rim of a sheet is larger and stays.
  std::size_t hole_edges = 64;
  double hole_share = 0.3;
};

struct RepairedMesh {
  TriangleMesh mesh;
  std::vector<Finding> changes;  // in order of the changes: how many and where; then the outcome
};

// Merges vertices, drops repeated and degenerate triangles, closes cracks, fills small holes, orients,
// stitches, and turns closed pieces outward. Triangles with an area are kept. Defects that it cannot mend
// (large holes, self-intersections) are left and reported. It always ends, and its time grows with the number
// of triangles, whatever their arrangement. Called only if the user asks for it.
RepairedMesh repair_mesh(const TriangleMesh& mesh, const RepairOptions& options = {});

}  // namespace polygon
