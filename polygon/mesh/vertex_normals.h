// SPDX-License-Identifier: GPL-3.0-or-later
// Normals at the vertices of a mesh, for shading only.
#pragma once

#include <glm/vec3.hpp>
#include <vector>

#include "polygon/mesh/mesh.h"

namespace polygon {

// [vertex] unit normal: the mean of the adjacent triangles' normals, weighted by their angles at the vertex
// (Thuermer & Wuethrich, Computing vertex normals from polygonal facets, 1998). The result does not depend on
// how a face was cut into triangles. Coincident vertices share one normal. The normal is zero if only
// degenerate triangles use the vertex, or if normals cancel. Floats resolve a direction to 1e-7 rad, at half
// the memory of doubles.
[[nodiscard]] std::vector<glm::vec3> angle_weighted_normals(const TriangleMesh& mesh);

}  // namespace polygon
