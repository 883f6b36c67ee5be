// SPDX-License-Identifier: GPL-3.0-or-later
// Second-order step for a ball on an edge or a corner. The plane that separates the ball from the edge turns
// as the ball moves. A sequence of minima over fixed planes is slow if the goal is near the edge: each step
// reduces the remaining distance by at most the fraction h/r, with h the distance from edge to goal and r the
// ball's radius. Newton's method for the constrained minimum (Nocedal & Wright, Numerical Optimization, 18.1)
// takes the turning of the plane into account, and one step suffices.
#pragma once

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <span>

#include "polygon/surface/rigid_surface.h"

namespace polygon {

// An active plane of PlaneMinimum, with its curvature.
struct CurvedConstraint {
  glm::dvec3 normal{0.0};
  double multiplier = 0.0;
  // Derivative of the normal by the proxy's position (unit: 1/meter); zero for a flat constraint.
  glm::dmat3 hessian{0.0};
};

// Hessian of the distance to an element at `view`, which is the derivative of the unit normal. It is
// symmetric, and acts across the normal. Measured by differences over `step` (unit: meter). Zero if `view`
// lies on the element.
glm::dmat3 distance_hessian(const RigidSurface& surface, std::uint32_t element, const glm::dvec3& view,
                            double step) noexcept;

// The minimum under one or two active constraints with curvature. `minimum` is the minimum under the flat
// planes, reached from `from`. The result lies on those planes, at most `furthest` from `minimum` (unit:
// meter). It is `minimum` itself if nothing curves, or if three planes leave no freedom.
glm::dvec3 minimum_on_curved_constraints(const glm::dvec3& from, const glm::dvec3& minimum,
                                         const glm::dmat3& metric, std::span<const CurvedConstraint> planes,
                                         double furthest) noexcept;

}  // namespace polygon
