// SPDX-License-Identifier: GPL-3.0-or-later
// Pairs of triangles that cut one another, by CGAL's exact predicates.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "polygon/mesh/mesh.h"

namespace polygon {

struct SelfIntersections {
  std::size_t pairs = 0;
  std::uint32_t first = 0, second = 0;  // the lowest such pair, when there is any
  glm::dvec3 lower{0.0}, upper{0.0};    // box of the middles of all triangles in such pairs
  bool complete = true;                 // false: ended by a bound; there may be more, and a lower one
};

// A million triangles that all cut one another have 5e11 pairs: the search ends after this many tests for
// each triangle on average. (A closed mesh needs about ten: its neighbours.)
inline constexpr std::size_t kMaxTestsPerTriangle = 100;

// `points`: no two equal; `triangles`: none without area. Two triangles that share an edge intersect when
// they are folded onto one another, two that share a corner when they meet elsewhere too; triangles with the
// same three corners do not count.
SelfIntersections find_self_intersections(std::span<const glm::dvec3> points,
                                          std::span<const TriangleIndices> triangles);

// Those of the triangles from `first_new` on that cut a triangle before them, in ascending order. When the
// bound on tests ends the search, all of them: what was not seen to be free is not called free.
std::vector<std::uint32_t> new_triangles_that_cut(std::span<const glm::dvec3> points,
                                                  std::span<const TriangleIndices> triangles,
                                                  std::uint32_t first_new);

}  // namespace polygon
