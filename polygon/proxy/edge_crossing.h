// SPDX-License-Identifier: GPL-3.0-or-later
// Where a convex surface bends a little, at the edges of its triangles. A ball pressed into such a surface
// has a minimum on every triangle that the way to its goal passes through; which of them it is in would
// depend on how it came, and the hand would feel the tessellation as a catch at every edge. So a proxy
// crosses to a nearer minimum when only a nearly flat edge lies between. At a sharp edge it stays: there,
// going over is what the hand would have to do.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>

#include "polygon/surface/rigid_surface.h"
#include "polygon/proxy/neighbourhood.h"

namespace polygon {

// The triangles beside one that touches the ball, across edges that bend away from the ball by at most 30
// degrees.
struct Ridges {
  struct Side {
    std::uint32_t element = kNoElement;
    SeparatingPlane plane;  // the element's own, for the ball's centre, on the ball's side
    double bend = 0.0;      // 1 − cosine of the angle between the normals
  };
  std::uint32_t element = kNoElement;  // the one that touches
  SeparatingPlane plane;
  std::uint32_t count = 0;
  std::array<Side, 3> sides;
};

// `plane` is the element's own, on the ball's side.
Ridges ridges_of(const RigidSurface& surface, std::uint32_t element, const SeparatingPlane& plane,
                 double radius, double rounding) noexcept;

// The side on whose plane the goal's ball would be least deep, if that is less than on the element itself by
// more than a twentieth of what the bend can make of it; nullptr when it is not. (With less than that, the
// noise of an encoder would make a proxy over an edge go to and fro.)
const Ridges::Side* nearer_side(const Ridges& ridges, const glm::dvec3& goal) noexcept;

// The points of the two planes' intersection and of the side's plane that are nearest to the goal: the way
// across lies in the element's plane to `top`, and in the side's to `end`.
struct RidgeCrossing {
  glm::dvec3 top{0.0}, end{0.0};
};
RidgeCrossing cross_ridge(const Ridges& ridges, const Ridges::Side& side, const glm::dvec3& goal) noexcept;

}  // namespace polygon
