// SPDX-License-Identifier: GPL-3.0-or-later
// Numbered checks of a mesh and its repair. README.md lists the findings, and what is left for people to
// mend. What takes more than counting is done by CGAL's exact predicates and its polygon mesh processing
// (repair.cpp, self_intersections.cpp).
#pragma once

#include "polygon/mesh/mesh.h"

namespace polygon {

struct MeshCheck {
  std::vector<Finding> findings;  // cheap to dear, each with a count and a place
  bool closed = false;            // every edge has exactly two triangles, coincident vertices taken as one
  bool oriented = false;          // closed and consistently oriented, outward (positive volume)
  double volume_m3 = 0.0;         // signed; 0 when not closed or not consistently oriented
};

// `deep` also looks for self-intersections (seconds at a million triangles).
MeshCheck check_mesh(const TriangleMesh& mesh, bool deep = false);

struct RepairOptions {
  // Vertices of borders this near to one another, as a share of the diagonal of the mesh's box, are merged
  // where that joins two border edges and does nothing else. Exporters that round to six digits need 1e-6.
  double crack_share = 1e-6;
  // A hole is small, and filled, when its loop has at most this many edges and its box a diagonal of at most
  // this share of that of its piece's box. The rim of a sheet is larger, and stays.
  std::size_t hole_edges = 64;
  double hole_share = 0.3;
};

struct RepairedMesh {
  TriangleMesh mesh;
  std::vector<Finding> changes;  // what was changed, in that order: how many and where; and how it ended
};

// Merges vertices, drops repeated triangles and those without area, joins cracks, fills small holes, orients,
// stitches, and turns closed pieces outward. Keeps everything that has an area: what it cannot mend (large
// holes, triangles that cut one another) is left and reported. Ends on anything, in time that grows with the
// triangles and not with how they lie. Never called unless the user asks for it.
RepairedMesh repair_mesh(const TriangleMesh& mesh, const RepairOptions& options = {});

}  // namespace polygon
