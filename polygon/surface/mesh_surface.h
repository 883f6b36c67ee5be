// SPDX-License-Identifier: GPL-3.0-or-later
// A triangle mesh as a RigidSurface, through a bounding volume hierarchy (bvh.h).
#pragma once

#include <memory>

#include "polygon/surface/rigid_surface.h"
#include "polygon/mesh/mesh.h"

namespace polygon {

struct SurfaceOptions {
  bool solid = false;           // the mesh is closed and consistently oriented, so inside() means something
  bool vertex_normals = false;  // kept, 12 bytes a vertex, so that shaded_normal() can interpolate them
};

// Builds the hierarchy (a third of a second for a million triangles). That works in floats about the mesh's
// own centre and proposes candidates conservatively; the closest points themselves are computed in double.
// The surface shares the mesh and makes no copy of it: about 42 bytes a triangle come on top,
// twelve of them the triangles across its edges.
//
// Triangles with the same three corners are one element, the first of them: a second copy adds nothing to a
// contact, and a million copies would make one query visit a million. When gather() is complete == false it
// has written the nearest out.size() elements (of equally near ones those first in the mesh). A query that is
// not finite, or whose point lies further than 1e18 m from the mesh, finds nothing. Throws
// std::invalid_argument for no mesh or an empty one, an index out of range or a vertex that is not finite (or
// beyond 1e12 m), std::runtime_error when Embree fails.
std::unique_ptr<RigidSurface> make_mesh_surface(std::shared_ptr<const TriangleMesh> mesh,
                                                const SurfaceOptions& options);
// The same of a copy of the mesh.
std::unique_ptr<RigidSurface> make_mesh_surface(const TriangleMesh& mesh, bool solid);

// Closest point of a triangle to p, with degenerate triangles as named branches (a segment, a point).
glm::dvec3 closest_point_on_triangle(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b,
                                     const glm::dvec3& c) noexcept;

}  // namespace polygon
