// SPDX-License-Identifier: GPL-3.0-or-later
// Points that stand for the surface of a rigid object where it meets that of another.
//
// Two surfaces that are kept apart at all points of the one and all points of the other overlap nowhere by
// more than what lies between points: nothing for a ball (its centre, with its radius) and for a corner or a
// face on anything; up to half of the points' distance where two edges cross, which is why those on edges
// slide to where they cross. So points are needed where a surface is not flat: at vertices and along sharp
// edges, and none inside faces.
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
  // Between two other points, earlier in the list, on a straight edge, of which the points stand in the list
  // in order. It may slide along that, this far either way.
  std::array<std::uint32_t, 2> ends{};
  glm::dvec3 along{0.0};  // unit
  double reach_m = 0.0;
  [[nodiscard]] bool has_ends() const { return ends[0] != ends[1]; }
};

inline constexpr std::size_t kMostSurfacePoints = 800;

// Of an object whose surface is `shape` (body frame). A ball is its centre, a capsule lies along its axis;
// of everything else they are the shape's vertices and points along its sharp edges. Beyond
// kMostSurfacePoints they are thinned evenly, the sharpest kept. Deterministic.
[[nodiscard]] std::vector<SurfacePoint> surface_points(const RigidSource& source,
                                                       const polygon::TriangleMesh& shape);

}  // namespace hybrid
