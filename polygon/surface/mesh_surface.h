// SPDX-License-Identifier: GPL-3.0-or-later
// A triangle mesh as a RigidSurface. Embree's hierarchy (bvh.h) proposes candidates conservatively, in floats
// about the mesh's centre. Closest points are computed in double.
#pragma once

#include <memory>

#include "polygon/mesh/mesh.h"
#include "polygon/surface/rigid_surface.h"

namespace polygon {

struct SurfaceOptions {
  bool solid = false;           // the mesh is closed and consistently oriented, so that inside() is defined
  bool vertex_normals = false;  // stores vertex normals (12 bytes each) for shaded_normal()
};

// Shares the mesh and makes no copy of it. Beyond the mesh, the surface takes about 42 bytes per triangle, 12
// of them for the neighbours across edges.
//
// Triangles with the same three corners are one element, the first of them, so that a million copies do not
// slow a query. When gather() returns complete == false it has written the nearest out.size() elements
// (equally near ones in the mesh's order). A query finds nothing if it is not finite, or if its point is
// further than kFurthestQuery from the mesh. Throws std::invalid_argument for no mesh or an empty one, an
// index out of range, or a vertex that is not finite or beyond 1e12 m; std::runtime_error if Embree fails.
std::unique_ptr<RigidSurface> make_mesh_surface(std::shared_ptr<const TriangleMesh> mesh,
                                                const SurfaceOptions& options);
// The same for a copy of the mesh.
std::unique_ptr<RigidSurface> make_mesh_surface(const TriangleMesh& mesh, bool solid);

}  // namespace polygon
