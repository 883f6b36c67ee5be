// SPDX-License-Identifier: GPL-3.0-or-later
// Closest points of triangles for the optimality reference, in long double. This code is independent of the
// proxy's closest points (triangle.h), so that an error in either one shows.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>

#include "polygon/reference/stationary_point.h"

namespace polygon {

// A triangle in coordinates relative to a nearby origin. In these coordinates long double resolves the small
// differences that matter.
struct NearTriangle {
  std::uint32_t id = 0;
  std::array<FineVec, 3> corner;  // relative to the origin; exact or nearly so
  std::array<FineVec, 3>
      side;  // [i] unit direction from corner i to corner (i + 1) % 3; zero if these coincide
  std::array<FineReal, 3> length{};
  FineVec normal{0.0L};
  bool has_area = false;     // the triangle is not degenerate and `normal` is defined
  FineReal distance = 0.0L;  // from the origin
};

[[nodiscard]] NearTriangle near_triangle(std::uint32_t id, const std::array<glm::dvec3, 3>& corners,
                                         const glm::dvec3& origin);

// The nearest point of a triangle to a query point.
struct ClosestPoint {
  FineVec point{0.0L};
  FineReal distance = 0.0L;
};

// The nearest point of a triangle: the foot on its plane if this lies within all sides, otherwise the nearest
// point of the sides. A degenerate triangle consists of its sides only.
[[nodiscard]] ClosestPoint closest_on(const NearTriangle& t, const FineVec& x);

// The nearest point of the side from corner i to corner (i + 1) % 3.
[[nodiscard]] ClosestPoint closest_on_side(const NearTriangle& t, std::size_t i, const FineVec& x);

// v scaled to unit length; zero for zero.
[[nodiscard]] FineVec unit(const FineVec& v);

}  // namespace polygon
