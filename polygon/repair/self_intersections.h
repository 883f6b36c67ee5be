// SPDX-License-Identifier: GPL-3.0-or-later
// Finds triangles that intersect one another, with CGAL's exact predicates. The number of tests is bounded.
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
  std::uint32_t first = 0, second = 0;  // the pair of lowest indices, if there is one
  glm::dvec3 lower{0.0}, upper{0.0};    // box around the centres of all triangles in such pairs
  // False if the bound ended the search. Then there may be more pairs, and one of lower indices.
  bool complete = true;
};

// The search ends after this many tests per triangle on average. A closed mesh needs about ten, for the
// neighbours. A million mutually intersecting triangles would have 5e11 pairs.
inline constexpr std::size_t kMaxTestsPerTriangle = 100;

// `points`: all different; `triangles`: none degenerate. Two triangles with a common edge intersect if they
// are folded onto one another. Two triangles with a common corner intersect if they also meet elsewhere.
// Triangles with the same three corners do not count.
SelfIntersections find_self_intersections(std::span<const glm::dvec3> points,
                                          std::span<const TriangleIndices> triangles);

// The indices, ascending, of triangles from `first_new` on that intersect a triangle with a lower index. If
// the bound on tests ends the search, all new triangles are returned, because none is known to be free of
// intersections.
std::vector<std::uint32_t> new_triangles_that_cut(std::span<const glm::dvec3> points,
                                                  std::span<const TriangleIndices> triangles,
                                                  std::uint32_t first_new);

}  // namespace polygon
