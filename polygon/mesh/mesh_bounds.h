// SPDX-License-Identifier: GPL-3.0-or-later
// What has to be known of a mesh as a whole before it can be felt.
#pragma once

#include <glm/vec3.hpp>

#include "polygon/mesh/mesh.h"

namespace polygon {

struct MeshBounds {
  glm::dvec3 low{0.0}, high{0.0};  // of the vertices that triangles use (unit: meter)
};

// Throws std::invalid_argument: no triangle, 2^32 - 1 of them or more, an index out of range, a vertex that
// is not finite or beyond 1e12 m (which keeps every square and product far from overflow).
[[nodiscard]] MeshBounds checked_bounds(const TriangleMesh& mesh);

// Is the point inside a closed mesh, by the solid angle of all of it (van Oosterom and Strackee 1983)? Right
// whatever the nearest triangles look like, but it visits every one.
[[nodiscard]] bool winds_around(const TriangleMesh& mesh, const glm::dvec3& point) noexcept;

}  // namespace polygon
