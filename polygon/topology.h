// SPDX-License-Identifier: GPL-3.0-or-later
// What is connected with what in a triangle soup, by exactly equal coordinates. The soup itself is not
// changed.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "polygon/mesh.h"

namespace polygon {

// Vertices of exactly equal coordinates (0 and -0 are equal) become one point.
struct WeldedVertices {
  std::vector<std::uint32_t> point_of;  // one a vertex: its point, numbered in order of first appearance
  std::uint32_t points = 0;
};
[[nodiscard]] WeldedVertices weld_vertices(std::span<const glm::dvec3> vertices);

// The mesh's triangles with points for corners.
[[nodiscard]] std::vector<TriangleIndices> welded_triangles(const TriangleMesh& mesh,
                                                            const WeldedVertices& welded);

// Fewer than three different corners: it has no inside, and takes no part in what is connected.
[[nodiscard]] inline bool has_repeated_corner(const TriangleIndices& t) {
  return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
}

// One side of one triangle. Edge i runs from corner i to corner (i + 1) % 3.
struct EdgeUse {
  std::uint32_t low = 0, high = 0;  // points, low < high
  std::uint32_t triangle = 0;
  std::uint8_t edge = 0;
  bool forward = false;  // the triangle runs from low to high
};

// All sides of all triangles without repeated corners, those of the same edge next to one another, in
// ascending order of (low, high, triangle).
[[nodiscard]] std::vector<EdgeUse> sorted_edges(std::span<const TriangleIndices> triangles,
                                                std::uint32_t points);

// One a triangle: the lowest triangle with the same three points, whatever their order; itself when it is the
// first.
[[nodiscard]] std::vector<std::uint32_t> first_duplicates(std::span<const TriangleIndices> triangles,
                                                          std::uint32_t points);

}  // namespace polygon
