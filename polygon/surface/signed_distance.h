// SPDX-License-Identifier: GPL-3.0-or-later
// How far a point is from a rigid surface and which way is out of it, from within a solid too.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>

#include "polygon/surface/rigid_surface.h"

namespace polygon {

struct SignedDistance {
  glm::dvec3 normal{0.0};  // unit, out of the solid; of a sheet, towards the point
  double distance = 0.0;   // along it (unit: meter); negative within a solid
  std::uint32_t element = 0;
};

// The nearest place of the surface within `radius` of the point (body frame). `known` is the normal that the
// point had a moment ago, or zero: where the surface is still seen from that side, a mesh is not asked for
// its inside, and on the surface itself, where there is no way out to be seen, it stays. False when nothing
// is so near, or no normal is to be had.
[[nodiscard]] bool signed_distance(const RigidSurface& surface, const glm::dvec3& point, double radius,
                                   const glm::dvec3& known, SignedDistance& out) noexcept;

}  // namespace polygon
