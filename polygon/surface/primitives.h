// SPDX-License-Identifier: GPL-3.0-or-later
// Exact convex primitives with closed-form closest points, and their tessellations. Tessellations serve
// pictures, the occupancy map, and the comparison of a mesh with its exact shape.
#pragma once

#include <memory>

#include "polygon/mesh/mesh.h"
#include "polygon/surface/rigid_surface.h"

namespace polygon {

// All are centred on the body's origin. Sizes are in meters, finite and > 0 (half_length may be 0);
// std::invalid_argument otherwise. Each is one convex element, number 0. From inside a solid primitive the
// distance is 0, and `point` is the nearest point of the surface. Of several equally near points one is
// chosen by the body's axes.
std::unique_ptr<RigidSurface> make_ball_surface(double radius);
std::unique_ptr<RigidSurface> make_box_surface(const glm::dvec3& half_size);
// Capsule along the body's z axis: a segment of length 2·half_length, rounded by `radius`.
std::unique_ptr<RigidSurface> make_capsule_surface(double radius, double half_length);
// A two-sided square sheet of no thickness: z = 0, |x|, |y| <= half_size (body frame). It has no inside.
std::unique_ptr<RigidSurface> make_plane_surface(double half_size);

// Tessellations, outward counter-clockwise (the plane's front faces +z), each vertex once. Ball: an icosphere
// of 20·4^subdivisions triangles, all vertices on the sphere, subdivisions 0 to 9. Box: 12·quads_per_edge²
// triangles; plane: 2·quads_per_edge²; quads_per_edge 1 to 1024. Capsule: `segments` around it (3 to 1024),
// and caps divided as finely. Other numbers throw std::invalid_argument, with the allowed numbers in its
// text.
TriangleMesh make_ball_mesh(double radius, int subdivisions);
TriangleMesh make_box_mesh(const glm::dvec3& half_size, int quads_per_edge);
TriangleMesh make_capsule_mesh(double radius, double half_length, int segments);
TriangleMesh make_plane_mesh(double half_size, int quads_per_edge);

}  // namespace polygon
