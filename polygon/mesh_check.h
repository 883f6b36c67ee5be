// SPDX-License-Identifier: GPL-3.0-or-later
// Numbered checks of a mesh and its repair, by CGAL's polygon mesh processing; mesh_repair.cpp and
// self_intersections.cpp are the only files of the project that know CGAL. README.md lists the findings.
#pragma once

#include "polygon/mesh.h"

namespace polygon {

struct MeshCheck {
  std::vector<Finding> findings;  // cheap to dear, each with a count and a place
  bool closed = false;            // every edge has exactly two triangles, coincident vertices taken as one
  bool oriented = false;          // closed and consistently oriented, outward (positive volume)
  double volume_m3 = 0.0;         // signed; 0 when not closed or not consistently oriented
};

// `deep` also looks for self-intersections (seconds at a million triangles).
MeshCheck check_mesh(const TriangleMesh& mesh, bool deep = false);

struct RepairedMesh {
  TriangleMesh mesh;
  std::vector<Finding> changes;  // what was changed, and how many
};

// Merges coincident vertices, drops degenerate and duplicate triangles, orients the soup, stitches
// borders and turns a closed mesh outward. Never called unless the user asks for it.
RepairedMesh repair_mesh(const TriangleMesh& mesh);

}  // namespace polygon
