// SPDX-License-Identifier: GPL-3.0-or-later
// Closest point of a triangle, and which part of the triangle it lies on.
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

// No area to speak of: the sine of the angle between two edges is below 1e-14, so a normal would be rounding.
[[nodiscard]] bool is_degenerate(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) noexcept;

// Unit normal by the right hand; zero for a degenerate triangle, whose normal would be rounding.
[[nodiscard]] glm::dvec3 unit_normal(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) noexcept;

// Angle at `a` between the directions to b and to c (radians, 0 to π).
[[nodiscard]] double corner_angle(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) noexcept;

[[nodiscard]] TrianglePoint closest_on_triangle(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b,
                                                const glm::dvec3& c) noexcept;

// Whether a triangle may come within `radius` of `centre`: no when its bounds do not, nor a plane across the
// way from its middle to `view`. That plane, with the triangle behind it, is the answer: as good as the
// closest point's from a few edges away, in a third of the time.
struct TriangleSight {
  glm::dvec3 normal{0.0};  // unit, towards the view; zero when that is the triangle's middle
  double reach = 0.0;      // max over the triangle of normal · x
};
[[nodiscard]] inline bool see_triangle(const glm::dvec3& centre, double radius, const glm::dvec3& view,
                                       const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
                                       TriangleSight& sight) noexcept {
  const glm::dvec3 low = glm::min(glm::min(a, b), c), high = glm::max(glm::max(a, b), c);
  const glm::dvec3 out = glm::max(glm::max(low - centre, centre - high), glm::dvec3(0.0));
  if (!(glm::dot(out, out) <= radius * radius)) return false;
  const glm::dvec3 away = view - (a + b + c) * (1.0 / 3.0);
  const double square = glm::dot(away, away);
  sight.normal = square > 0.0 ? away * (1.0 / std::sqrt(square)) : glm::dvec3(0.0);
  sight.reach = std::max({glm::dot(sight.normal, a), glm::dot(sight.normal, b), glm::dot(sight.normal, c)});
  return glm::dot(sight.normal, centre) - sight.reach <= radius;
}

}  // namespace polygon
