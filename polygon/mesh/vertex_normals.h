// SPDX-License-Identifier: GPL-3.0-or-later
// Normals at a mesh's vertices, for shading. Nothing else needs them, so nothing else pays for them.
#pragma once

#include <glm/vec3.hpp>
#include <vector>

#include "polygon/mesh/mesh.h"

namespace polygon {

// One a vertex, of unit length: the normals of the triangles around it, weighted by their angles there
// (Thuermer and Wuethrich, Computing vertex normals from polygonal facets, 1998), which does not depend on
// how a face was cut into triangles. Coincident vertices have the same normal; one that only degenerate
// triangles use, or whose triangles cancel, has zero. Floats: good to 1e-7 of a direction, at half the
// memory.
[[nodiscard]] std::vector<glm::vec3> angle_weighted_normals(const TriangleMesh& mesh);

}  // namespace polygon
