// SPDX-License-Identifier: GPL-3.0-or-later
// Pairs of triangles that cut one another, by CGAL's exact predicates.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>

#include "polygon/mesh.h"

namespace polygon {

struct SelfIntersections {
  std::size_t pairs = 0;
  std::uint32_t first = 0, second = 0;  // one such pair, when there is any
};

// `points`: no two equal; `triangles`: none without area. Two triangles that share an edge intersect when
// they are folded onto one another, two that share a corner when they meet elsewhere too; triangles with the
// same three corners do not count.
SelfIntersections find_self_intersections(std::span<const glm::dvec3> points,
                                          std::span<const TriangleIndices> triangles);

}  // namespace polygon
