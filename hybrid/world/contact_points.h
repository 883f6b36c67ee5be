// SPDX-License-Identifier: GPL-3.0-or-later
// Points that represent the surface of a rigid object in contacts with other rigid objects.
//
// If all points of object A are outside object B, and all points of B are outside A, the two can still
// overlap between points. This error is zero for a ball (one point: its centre, with its radius), and where a
// corner or a face touches anything. Where two edges cross, the overlap is up to half the distance between
// points. Therefore points on edges slide to the crossing. Points are needed where a surface is not flat: at
// vertices and along sharp edges. The inside of a face needs none.
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
  // Indices of the points at the two ends of this point's edge. Both are earlier in the list. The points of
  // one edge are consecutive and in order. The point may slide by `reach_m` in either direction `along` the
  // edge.
  std::array<std::uint32_t, 2> ends{};
  glm::dvec3 along{0.0};  // unit
  double reach_m = 0.0;
  [[nodiscard]] bool has_ends() const { return ends[0] != ends[1]; }
};

inline constexpr std::size_t kMostSurfacePoints = 800;  // points of one object, at most

// Points of an object whose surface is `shape` (body frame): the centre of a ball, points on the axis of a
// capsule, and otherwise the shape's vertices and points along its sharp edges. If there are more than
// kMostSurfacePoints, only the sharpest point of each cell of a grid is kept. The cells grow until few enough
// points are left. Deterministic.
[[nodiscard]] std::vector<SurfacePoint> surface_points(const RigidSource& source,
                                                       const polygon::TriangleMesh& shape);

}  // namespace hybrid
