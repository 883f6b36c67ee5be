// SPDX-License-Identifier: GPL-3.0-or-later
// Points that represent the surface of a rigid object in contact with another.
//
// If all points of one surface and all points of the other are outside the other object, the surfaces overlap
// at most between points. The error is zero for a ball (its centre with its radius), and for a corner or a
// face on anything. It is up to half of the points' distance where two edges cross, which is why points on
// edges slide to the crossing. Points are therefore needed where a surface is not flat: at vertices and along
// sharp edges, and none inside faces.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "hybrid/scene/scene.h"
#include "polygon/mesh/mesh.h"

namespace hybrid {

struct SurfacePoint {
  glm::dvec3 at_m{0.0};   // body frame
  double radius_m = 0.0;  // a ball of this radius is part of the object
  // The neighbours on the same straight edge, earlier in the list; points of one edge stand in order. The
  // point may slide along the edge, this far in either direction.
  std::array<std::uint32_t, 2> ends{};
  glm::dvec3 along{0.0};  // unit
  double reach_m = 0.0;
  [[nodiscard]] bool has_ends() const { return ends[0] != ends[1]; }
};

inline constexpr std::size_t kMostSurfacePoints = 800;

// Points of an object whose surface is `shape` (body frame): the centre of a ball, points on the axis of a
// capsule, and otherwise the shape's vertices and points along its sharp edges. Beyond kMostSurfacePoints
// only the sharpest point of each cell of a grid is kept; cells grow until few enough are left.
// Deterministic.
[[nodiscard]] std::vector<SurfacePoint> surface_points(const RigidSource& source,
                                                       const polygon::TriangleMesh& shape);

}  // namespace hybrid
