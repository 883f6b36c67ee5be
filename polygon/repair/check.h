// SPDX-License-Identifier: GPL-3.0-or-later
// Numbered checks of a mesh, and the repair of a mesh. README.md lists the findings, and the defects that a
// person has to mend. Self-intersections are found with CGAL's exact predicates (self_intersections.cpp).
// Merging, closing cracks and filling holes are own code; CGAL orients and stitches (repair.cpp).
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
  // Numbers of edges: with one triangle, with more than two, and with two that run through the edge in the
  // same direction.
  std::size_t border_edges = 0, nonmanifold_edges = 0, turned_edges = 0;
};

// The way in which the mesh is touched, for a message: "a closed solid", or "a two-sided sheet" and the
// reason.
[[nodiscard]] std::string touched_as(const MeshCheck& check);

// `deep` also searches for self-intersections (seconds for a million triangles).
MeshCheck check_mesh(const TriangleMesh& mesh, bool deep = false);

struct RepairOptions {
  // Border vertices are merged within this fraction of the mesh's diagonal, if the merging joins two border
  // edges and changes nothing else. Cracks from exporters that round to six digits need 1e-6.
  double crack_share = 1e-6;
  // A hole is small, and is filled, if its loop has at most `hole_edges` edges and the diagonal of the loop's
  // bounding box is at most `hole_share` of the diagonal of its piece's bounding box. The rim of a sheet is
  // larger and stays.
  std::size_t hole_edges = 64;
  double hole_share = 0.3;
};

struct RepairedMesh {
  TriangleMesh mesh;
  std::vector<Finding>
      changes;  // in order of the changes, each with a count and a place; the outcome is last
};

// Merges vertices, drops repeated and degenerate triangles, closes cracks, fills small holes, orients,
// stitches, and turns closed pieces outward. Triangles with an area are kept. Defects that a repair cannot
// mend (large holes, self-intersections) are left and reported. The work is bounded for every arrangement of
// triangles, and the bound grows with their number. A mesh is repaired only if the user asks for it.
RepairedMesh repair_mesh(const TriangleMesh& mesh, const RepairOptions& options = {});

}  // namespace polygon
