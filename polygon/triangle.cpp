// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/triangle.h"

#include <array>
#include <glm/geometric.hpp>
#include <limits>

#include "polygon/mesh_surface.h"

namespace polygon {
namespace {

constexpr double kDegenerateSineSquared = 1e-28;

bool normal_is_rounding(const glm::dvec3& n, const glm::dvec3& ab, const glm::dvec3& ac) {
  return !(glm::dot(n, n) > kDegenerateSineSquared * glm::dot(ab, ab) * glm::dot(ac, ac));
}

// Closest point of the segment; a segment of no length is its first end.
void improve_with_segment(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b, int edge,
                          TrianglePoint& best) {
  const glm::dvec3 ab = b - a;
  const double along = glm::dot(p - a, ab);
  const double length2 = glm::dot(ab, ab);
  TrianglePoint candidate;
  if (!(along > 0.0)) {
    candidate.point = a;
    candidate.feature = static_cast<TriangleFeature>(edge);
  } else if (along >= length2) {
    candidate.point = b;
    candidate.feature = static_cast<TriangleFeature>((edge + 1) % 3);
  } else {
    candidate.point = a + ab * (along / length2);
    candidate.feature = static_cast<TriangleFeature>(3 + edge);
  }
  const glm::dvec3 away = p - candidate.point;
  candidate.squared_distance = glm::dot(away, away);
  if (candidate.squared_distance < best.squared_distance) best = candidate;
}

}  // namespace

bool is_degenerate(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) noexcept {
  return normal_is_rounding(glm::cross(b - a, c - a), b - a, c - a);
}

// Ericson's form (Real-Time Collision Detection, section 5.1.5) decides by products of four lengths, whose
// rounding grows with 1/area²; the edge functions below are triple products with the normal, whose rounding
// grows with 1/area, which is what slivers need. The closest point of a convex set lies on an edge that the
// point is beyond (or on the corner of one), so only those edges are looked at.
TrianglePoint closest_on_triangle(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b,
                                  const glm::dvec3& c) noexcept {
  const glm::dvec3 ab = b - a;
  const glm::dvec3 ac = c - a;
  const glm::dvec3 n = glm::cross(ab, ac);
  const glm::dvec3 pa = a - p;
  const glm::dvec3 pb = b - p;
  const glm::dvec3 pc = c - p;
  const bool degenerate = normal_is_rounding(n, ab, ac);
  const std::array<double, 3> beyond{glm::dot(n, glm::cross(pa, pb)), glm::dot(n, glm::cross(pb, pc)),
                                     glm::dot(n, glm::cross(pc, pa))};
  if (!degenerate && beyond[0] > 0.0 && beyond[1] > 0.0 && beyond[2] > 0.0) {
    const double height = glm::dot(n, pa) / glm::dot(n, n);
    TrianglePoint result;
    result.point = p + n * height;
    result.squared_distance = height * height * glm::dot(n, n);
    result.feature = TriangleFeature::face;
    return result;
  }
  TrianglePoint best;
  best.squared_distance = std::numeric_limits<double>::infinity();
  best.point = a;
  // Degenerate: a segment, or a point, is the union of its edges, so every edge is looked at.
  if (degenerate || !(beyond[0] > 0.0)) improve_with_segment(p, a, b, 0, best);
  if (degenerate || !(beyond[1] > 0.0)) improve_with_segment(p, b, c, 1, best);
  if (degenerate || !(beyond[2] > 0.0)) improve_with_segment(p, c, a, 2, best);
  return best;
}

glm::dvec3 closest_point_on_triangle(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b,
                                     const glm::dvec3& c) noexcept {
  return closest_on_triangle(p, a, b, c).point;
}

}  // namespace polygon
