// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/proxy/edge_crossing.h"

#include <glm/geometric.hpp>

namespace polygon {
namespace {

// Bounds of the bend at an edge that the proxy may cross (unit: 1 − cosine of the angle between the normals).
// 0.134 is 30°. Below kFlat both triangles lie in one plane, and there is no edge to cross.
constexpr double kNearlyFlat = 0.134;
constexpr double kFlat = 1e-12;
constexpr double kHysteresis = 0.05;  // see nearer_side() (unit: bend · depth of the goal)

}  // namespace

CrossableEdges crossable_edges_of(const RigidSurface& surface, std::uint32_t element,
                                  const SeparatingPlane& plane, double radius, double rounding) noexcept {
  CrossableEdges edges;
  edges.element = element;
  edges.plane = plane;
  for (const std::uint32_t other : surface.neighbours(element)) {
    if (other == kNoElement) continue;
    glm::dvec3 normal = surface.face_normal(other);
    // Neighbours need not be oriented alike, but the ball is on one side of both.
    if (glm::dot(normal, plane.normal) < 0.0) normal = -normal;
    const glm::dvec3 turned = normal - plane.normal;
    const double bend = 0.5 * glm::dot(turned, turned);
    // Flat (nothing to cross), sharp or degenerate.
    if (!(bend > kFlat && bend < kNearlyFlat)) continue;
    const double offset = surface.support(other, normal) + radius;
    const bool convex = surface.support(other, plane.normal) <= plane.offset - radius + rounding &&
                        surface.support(element, normal) <= offset - radius + rounding;
    if (convex) edges.sides[edges.count++] = {other, {normal, offset}, bend};
  }
  return edges;
}

const CrossableEdges::Side* nearer_side(const CrossableEdges& edges, const glm::dvec3& goal) noexcept {
  const double depth = edges.plane.offset - glm::dot(edges.plane.normal, goal);
  const CrossableEdges::Side* nearest = nullptr;
  double least = depth;
  for (std::uint32_t n = 0; n < edges.count; ++n) {
    const CrossableEdges::Side& side = edges.sides[n];
    const double there = side.plane.offset - glm::dot(side.plane.normal, goal);
    // A goal above the side's plane is not constrained by it.
    if (!(there > 0.0) || there >= least || !(depth - there > kHysteresis * side.bend * depth)) continue;
    least = there;
    nearest = &side;
  }
  return nearest;
}

EdgeCrossing cross_edge(const CrossableEdges& edges, const CrossableEdges::Side& side,
                        const glm::dvec3& goal) noexcept {
  const glm::dvec3 &a = edges.plane.normal, &b = side.plane.normal;
  EdgeCrossing crossing;
  crossing.end = goal + (side.plane.offset - glm::dot(b, goal)) * b;
  // `top` lies in the side's plane, at the place across the edge where the element's plane begins. A weighted
  // sum of both normals, added to the goal, would be rounded, and would violate nearly parallel planes.
  const glm::dvec3 across = glm::normalize(a - b + side.bend * b);
  crossing.top =
      crossing.end + ((edges.plane.offset - glm::dot(a, crossing.end)) / glm::dot(a, across)) * across;
  return crossing;
}

}  // namespace polygon
