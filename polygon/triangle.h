// SPDX-License-Identifier: GPL-3.0-or-later
// Closest point of a triangle, and which part of the triangle it lies on.
#pragma once

#include <cstdint>
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

[[nodiscard]] TrianglePoint closest_on_triangle(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b,
                                                const glm::dvec3& c) noexcept;

}  // namespace polygon
