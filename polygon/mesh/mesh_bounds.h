// SPDX-License-Identifier: GPL-3.0-or-later
// Checks that a mesh can be used at all, and two properties of the whole mesh: its bounds and its winding.
#pragma once

#include <glm/vec3.hpp>

#include "polygon/mesh/mesh.h"

namespace polygon {

// Largest accepted coordinate (file units, and meters after scaling). Squares and products of such
// coordinates are far from overflow, and the coordinate itself fits a float.
inline constexpr double kLargestCoordinate = 1e12;
// Whether every coordinate is within the limit; false for NaN.
[[nodiscard]] bool is_usable(const glm::dvec3& coordinates);

struct MeshBounds {
  glm::dvec3 low{0.0}, high{0.0};  // of the vertices that triangles use (unit: meter)
};

// Bounds of the vertices that triangles use. Throws std::invalid_argument for no triangle, 2^32 - 1 triangles
// or more, an index out of range, or a vertex that is not finite or beyond 1e12 m.
[[nodiscard]] MeshBounds checked_bounds(const TriangleMesh& mesh);

// Whether the point is inside a closed mesh, by the total solid angle (van Oosterom & Strackee 1983). The
// result does not depend on the shape of the nearest triangles, but every triangle is visited.
[[nodiscard]] bool winds_around(const TriangleMesh& mesh, const glm::dvec3& point) noexcept;

}  // namespace polygon
