// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/mesh/triangle.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

namespace polygon {
namespace {

constexpr double kSmallestSquare = 1e-200;  // of a cross product's squared length; digits are lost below it
constexpr double kDegenerateSineSquared = 1e-28;  // sin² between two edges; below it the normal is rounding
// Rounding turns a normal by about epsilon / sine (rad). This shifts a foot point by the same fraction of the
// triangle's length: 0.5 % at a sine of 4e-14. If the sine is smaller than this bound, the edges are compared
// too. They are at most half of the triangle's width away.
constexpr double kNeedleSineSquared = 1e-12;

bool sine_is_below(double sine_squared, const glm::dvec3& n, const glm::dvec3& ab, const glm::dvec3& ac) {
  return !(glm::dot(n, n) > sine_squared * glm::dot(ab, ab) * glm::dot(ac, ac));
}
bool normal_is_rounding(const glm::dvec3& n, const glm::dvec3& ab, const glm::dvec3& ac) {
  return sine_is_below(kDegenerateSineSquared, n, ab, ac);
}

// Replaces `best` by the closest point of the segment a to b, if that is closer. A segment of zero length
// counts as its first end.
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

glm::dvec3 unit_normal(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) noexcept {
  const glm::dvec3 n = glm::cross(b - a, c - a);
  if (normal_is_rounding(n, b - a, c - a)) return glm::dvec3(0.0);
  const double square = glm::dot(n, n);
  if (square > kSmallestSquare) return n * (1.0 / std::sqrt(square));
  // The edges are normalised first, because the cross product of two nanometer edges has a denormal squared
  // length.
  return glm::normalize(glm::cross(glm::normalize(b - a), glm::normalize(c - a)));
}

double corner_angle(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) noexcept {
  return std::atan2(glm::length(glm::cross(b - a, c - a)), glm::dot(b - a, c - a));
}

// Ericson's form (Real-Time Collision Detection, section 5.1.5) compares products of four lengths, whose
// rounding error grows with 1/area². The edge functions below are triple products with the normal, whose
// rounding error grows only with 1/area. Slivers need this accuracy. The closest point of a convex set lies
// on an edge that the query point is beyond, so only those edges are tested.
TrianglePoint closest_on_triangle(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b,
                                  const glm::dvec3& c) noexcept {
  const glm::dvec3 ab = b - a;
  const glm::dvec3 ac = c - a;
  const glm::dvec3 n = glm::cross(ab, ac);
  const glm::dvec3 pa = a - p;
  const glm::dvec3 pb = b - p;
  const glm::dvec3 pc = c - p;
  const bool needle = sine_is_below(kNeedleSineSquared, n, ab, ac);
  const bool degenerate = needle && normal_is_rounding(n, ab, ac);
  const std::array<double, 3> beyond{glm::dot(n, glm::cross(pa, pb)), glm::dot(n, glm::cross(pb, pc)),
                                     glm::dot(n, glm::cross(pc, pa))};
  const bool above = !degenerate && beyond[0] > 0.0 && beyond[1] > 0.0 && beyond[2] > 0.0;
  if (above && !needle) {
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
  // A degenerate triangle (a segment or a point) is the union of its edges, so every edge is tested.
  if (needle || !(beyond[0] > 0.0)) improve_with_segment(p, a, b, 0, best);
  if (needle || !(beyond[1] > 0.0)) improve_with_segment(p, b, c, 1, best);
  if (needle || !(beyond[2] > 0.0)) improve_with_segment(p, c, a, 2, best);
  if (above) {
    // As a convex combination of the corners, the point lies in the triangle however the normal was rounded.
    TrianglePoint face;
    face.point = (beyond[1] * a + beyond[2] * b + beyond[0] * c) / (beyond[0] + beyond[1] + beyond[2]);
    face.squared_distance = glm::dot(p - face.point, p - face.point);
    if (face.squared_distance < best.squared_distance) best = face;
  }
  return best;
}

glm::dvec3 closest_point_on_triangle(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b,
                                     const glm::dvec3& c) noexcept {
  return closest_on_triangle(p, a, b, c).point;
}

}  // namespace polygon
