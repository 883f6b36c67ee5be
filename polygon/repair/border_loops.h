// SPDX-License-Identifier: GPL-3.0-or-later
// Finds the rims of a mesh: the rims of its holes and its outer edges. The check counts them, and the repair
// fills the small ones.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "polygon/mesh/mesh.h"
#include "polygon/mesh/topology.h"

namespace polygon {

// A sequence of border edges (edges of exactly one triangle). Its direction is that of a fill whose
// orientation agrees with the triangle at the first edge. Where several rims meet in a point, each continues
// around its own gap, so that two holes with a common corner are two loops. A loop may pass a point more than
// once.
struct BorderLoop {
  std::vector<std::uint32_t> points;     // if closed, the last edge ends at the first point
  std::vector<std::uint32_t> triangles;  // [i] the triangle at the edge from points[i]
  bool closed = true;                    // false: the loop ends at an edge of more than two triangles
  glm::dvec3 lower{0.0}, upper{0.0};     // bounds of the loop
};

// `edges` must be the table of these triangles. The order of the loops depends only on the mesh.
[[nodiscard]] std::vector<BorderLoop> border_loops(std::span<const glm::dvec3> points,
                                                   std::span<const TriangleIndices> triangles,
                                                   const EdgeTable& edges);

}  // namespace polygon
