// SPDX-License-Identifier: GPL-3.0-or-later
// Crossing of nearly flat edges. A ball pressed into a convex tessellated surface has a local minimum on each
// of several triangles. The path would decide which of these minima holds the ball, and the hand would feel a
// catch at every edge. So the proxy crosses to a neighbouring minimum that is nearer to the goal if only a
// nearly flat edge separates the two. At a sharp edge the proxy stays, because a hand has to go around it.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>

#include "polygon/proxy/neighbourhood.h"
#include "polygon/surface/rigid_surface.h"

namespace polygon {

// The neighbours of a touching triangle, across edges that bend away from the ball by at most 30 degrees.
struct CrossableEdges {
  struct Side {
    std::uint32_t element = kNoElement;
    SeparatingPlane plane;  // of that element's face, for the ball's centre, on the ball's side
    double bend = 0.0;      // 1 − cosine of the angle between the normals
  };
  std::uint32_t element = kNoElement;  // the touching triangle
  SeparatingPlane plane;
  std::uint32_t count = 0;
  std::array<Side, 3> sides;
};

// `plane` is the element's face plane on the ball's side (body frame). `radius` is the ball's, and `rounding`
// the tolerance of the convexity test (unit: meter).
CrossableEdges crossable_edges_of(const RigidSurface& surface, std::uint32_t element,
                                  const SeparatingPlane& plane, double radius, double rounding) noexcept;

// The side whose plane the goal violates least, or nullptr if the goal violates the element's own plane less.
// The difference must exceed a twentieth of bend · depth, with `depth` the goal's depth in the element's
// plane. This hysteresis keeps encoder noise from moving a proxy back and forth over an edge.
const CrossableEdges::Side* nearer_side(const CrossableEdges& edges, const glm::dvec3& goal) noexcept;

// Path across an edge, nearest to the goal: within the element's plane to `top` on the line where the planes
// meet, then within the side's plane to `end`.
struct EdgeCrossing {
  glm::dvec3 top{0.0}, end{0.0};
};
EdgeCrossing cross_edge(const CrossableEdges& edges, const CrossableEdges::Side& side,
                        const glm::dvec3& goal) noexcept;

}  // namespace polygon
