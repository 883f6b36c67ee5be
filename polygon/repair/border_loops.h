// SPDX-License-Identifier: GPL-3.0-or-later
// The rims of a mesh: its holes and its outer edges. Checks count them and repair fills them.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "polygon/mesh/mesh.h"
#include "polygon/mesh/topology.h"

namespace polygon {

// Border edges (of exactly one triangle) one after another, in the direction of a fill that agrees with the
// triangle at the first. Where several rims meet in a point, each goes on across the gap that it runs around,
// so that two holes with a common corner are two loops. A loop may pass a point more than once.
struct BorderLoop {
  std::vector<std::uint32_t> points;     // the end of the last edge is the first point, if it is closed
  std::vector<std::uint32_t> triangles;  // [i] at the edge from points[i]
  bool closed = true;                    // false: it ends where an edge has more than two triangles
  glm::dvec3 lower{0.0}, upper{0.0};     // its box
};

// `edges` is of these triangles. The order depends on the mesh alone.
[[nodiscard]] std::vector<BorderLoop> border_loops(std::span<const glm::dvec3> points,
                                                   std::span<const TriangleIndices> triangles,
                                                   const EdgeTable& edges);

}  // namespace polygon
