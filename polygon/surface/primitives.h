// SPDX-License-Identifier: GPL-3.0-or-later
// Exact convex primitives (their closest point is closed form) and their tessellations for pictures,
// the occupancy map and the comparison of a mesh with the shape it stands for.
#pragma once

#include <memory>

#include "polygon/surface/rigid_surface.h"
#include "polygon/mesh/mesh.h"

namespace polygon {

// All centred on the body origin, sizes in meters, finite and > 0 (std::invalid_argument otherwise;
// half_length may be 0). Each is one convex element, number 0. From inside a solid one the distance is 0, and
// `point` is the nearest point of its surface (of several equally near, one is chosen by the body's own
// axes).
std::unique_ptr<RigidSurface> make_ball_surface(double radius);
std::unique_ptr<RigidSurface> make_box_surface(const glm::dvec3& half_size);
// Capsule along body z: a segment of length 2·half_length with a round of `radius`.
std::unique_ptr<RigidSurface> make_capsule_surface(double radius, double half_length);
// A two-sided square sheet without thickness: body z = 0, |x|, |y| <= half_size. It has no inside.
std::unique_ptr<RigidSurface> make_plane_surface(double half_size);

// Tessellations, outward counter-clockwise (the plane's front looks along +z), each vertex once. Icosphere:
// 20·4^subdivisions triangles, every vertex on the sphere, subdivisions 0 to 9. Box: 12·quads_per_edge²
// triangles; plane: 2·quads_per_edge²; quads_per_edge 1 to 1024. Capsule: `segments` around (3 to 1024), the
// rounds as finely. std::invalid_argument with the numbers otherwise.
TriangleMesh make_ball_mesh(double radius, int subdivisions);
TriangleMesh make_box_mesh(const glm::dvec3& half_size, int quads_per_edge);
TriangleMesh make_capsule_mesh(double radius, double half_length, int segments);
TriangleMesh make_plane_mesh(double half_size, int quads_per_edge);

}  // namespace polygon
