// SPDX-License-Identifier: GPL-3.0-or-later
// A ball on an edge or a corner: the plane that holds it turns as it moves. A proxy that goes from minimum to
// minimum over such planes creeps where its goal lies near the edge, the more the nearer: what is left of the
// way shrinks by no more than h/r a step, h from the edge to the goal, r the ball's radius. With the turning
// in the model (Newton's method for the constrained minimum: Nocedal & Wright, Numerical Optimization, 18.1)
// one step gets there.
#pragma once

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <span>

#include "polygon/surface/rigid_surface.h"

namespace polygon {

// A plane that holds the proxy, as PlaneMinimum says.
struct TurningPlane {
  glm::dvec3 normal{0.0};
  double multiplier = 0.0;
  glm::dmat3 turning{0.0};  // how the normal changes as the proxy moves (unit: 1/meter); zero for a flat one
};

// Of the unit normal from an element to `view`, which is at some distance from it; symmetric, along the plane
// across that normal. `step`: over which it is measured (unit: meter).
glm::dmat3 turning_of(const RigidSurface& surface, std::uint32_t element, const glm::dvec3& view,
                      double step) noexcept;

// Where the minimum lies when the one or two planes that hold it turn: on those planes, at most `furthest`
// from `minimum`, which is the minimum over the planes as they stand, seen from `from`. `minimum` itself when
// nothing turns, or three planes leave no way to go.
glm::dvec3 minimum_on_turning_planes(const glm::dvec3& from, const glm::dvec3& minimum,
                                     const glm::dmat3& metric, std::span<const TurningPlane> planes,
                                     double furthest) noexcept;

}  // namespace polygon
