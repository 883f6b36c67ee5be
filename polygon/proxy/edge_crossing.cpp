// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/proxy/edge_crossing.h"

#include <glm/geometric.hpp>

namespace polygon {
namespace {

constexpr double kNearlyFlat = 0.134;  // 1 − cos 30°
constexpr double kFlat = 1e-12;
constexpr double kHysteresis = 0.05;

}  // namespace

Ridges ridges_of(const RigidSurface& surface, std::uint32_t element, const SeparatingPlane& plane,
                 double radius, double rounding) noexcept {
  Ridges ridges;
  ridges.element = element;
  ridges.plane = plane;
  for (const std::uint32_t other : surface.neighbours(element)) {
    if (other == kNoElement) continue;
    glm::dvec3 normal = surface.face_normal(other);
    // Neighbours need not be oriented alike; the ball is on one side of both.
    if (glm::dot(normal, plane.normal) < 0.0) normal = -normal;
    const glm::dvec3 turned = normal - plane.normal;
    const double bend = 0.5 * glm::dot(turned, turned);
    if (!(bend > kFlat && bend < kNearlyFlat)) continue;  // nothing to cross, sharp, or no area
    const double offset = surface.support(other, normal) + radius;
    const bool convex = surface.support(other, plane.normal) <= plane.offset - radius + rounding &&
                        surface.support(element, normal) <= offset - radius + rounding;
    if (convex) ridges.sides[ridges.count++] = {other, {normal, offset}, bend};
  }
  return ridges;
}

const Ridges::Side* nearer_side(const Ridges& ridges, const glm::dvec3& goal) noexcept {
  const double depth = ridges.plane.offset - glm::dot(ridges.plane.normal, goal);
  const Ridges::Side* nearest = nullptr;
  double least = depth;
  for (std::uint32_t n = 0; n < ridges.count; ++n) {
    const Ridges::Side& side = ridges.sides[n];
    const double there = side.plane.offset - glm::dot(side.plane.normal, goal);
    // A goal above the side's plane is not held by it.
    if (!(there > 0.0) || there >= least || !(depth - there > kHysteresis * side.bend * depth)) continue;
    least = there;
    nearest = &side;
  }
  return nearest;
}

RidgeCrossing cross_ridge(const Ridges& ridges, const Ridges::Side& side, const glm::dvec3& goal) noexcept {
  const glm::dvec3 &a = ridges.plane.normal, &b = side.plane.normal;
  RidgeCrossing crossing;
  crossing.end = goal + (side.plane.offset - glm::dot(b, goal)) * b;
  // In the side's plane up to the element's, across the edge. Not as a sum of both normals from the goal:
  // nearly parallel, they would lose to rounding what keeps the way clear.
  const glm::dvec3 across = glm::normalize(a - b + side.bend * b);
  crossing.top =
      crossing.end + ((ridges.plane.offset - glm::dot(a, crossing.end)) / glm::dot(a, across)) * across;
  return crossing;
}

}  // namespace polygon
