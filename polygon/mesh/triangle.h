// SPDX-License-Identifier: GPL-3.0-or-later
// Closest point of a triangle, and the feature of the triangle on which it lies. Degenerate triangles
// (segments and points) are handled separately.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

namespace polygon {

// Edge i runs from corner i to corner (i + 1) % 3.
enum class TriangleFeature : std::uint8_t { corner0, corner1, corner2, edge0, edge1, edge2, face };

struct TrianglePoint {
  glm::dvec3 point{0.0};
  double squared_distance = 0.0;
  TriangleFeature feature = TriangleFeature::face;
};

// True if the sine of the angle at `a` is below 1e-14. Such a triangle's normal would be rounding error.
[[nodiscard]] bool is_degenerate(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) noexcept;

// Unit normal by the right-hand rule; zero for a degenerate triangle.
[[nodiscard]] glm::dvec3 unit_normal(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) noexcept;

// Angle at `a` between the directions to b and to c (radians, 0 to π).
[[nodiscard]] double corner_angle(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) noexcept;

// Closest point of the triangle to p.
[[nodiscard]] TrianglePoint closest_on_triangle(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b,
                                                const glm::dvec3& c) noexcept;

// Only the point that closest_on_triangle() returns.
glm::dvec3 closest_point_on_triangle(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b,
                                     const glm::dvec3& c) noexcept;

// A plane that bounds a triangle on the side of a point `view`: normal · x <= support for every point x of
// the triangle.
struct TrianglePlane {
  glm::dvec3 normal{0.0};  // unit, from the centroid towards `view`; zero if they coincide
  double support = 0.0;    // maximum of normal · x over the triangle (unit: meter)
};
// Computes the plane of a triangle that may come within `radius` of `centre`. Returns false if the triangle's
// bounds or this plane show that the triangle is further away. At a distance of a few edge lengths, the plane
// is as good as one through the closest point, and cheaper.
[[nodiscard]] inline bool triangle_plane_within(const glm::dvec3& centre, double radius,
                                                const glm::dvec3& view, const glm::dvec3& a,
                                                const glm::dvec3& b, const glm::dvec3& c,
                                                TrianglePlane& plane) noexcept {
  const glm::dvec3 low = glm::min(glm::min(a, b), c), high = glm::max(glm::max(a, b), c);
  const glm::dvec3 out = glm::max(glm::max(low - centre, centre - high), glm::dvec3(0.0));
  if (!(glm::dot(out, out) <= radius * radius)) return false;
  const glm::dvec3 away = view - (a + b + c) * (1.0 / 3.0);
  const double square = glm::dot(away, away);
  plane.normal = square > 0.0 ? away * (1.0 / std::sqrt(square)) : glm::dvec3(0.0);
  plane.support = std::max({glm::dot(plane.normal, a), glm::dot(plane.normal, b), glm::dot(plane.normal, c)});
  return glm::dot(plane.normal, centre) - plane.support <= radius;
}

}  // namespace polygon
