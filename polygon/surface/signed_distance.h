// SPDX-License-Identifier: GPL-3.0-or-later
// Signed distance to a rigid surface and the direction out of it, also from inside a solid.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>

#include "polygon/surface/rigid_surface.h"

namespace polygon {

struct SignedDistance {
  glm::dvec3 normal{0.0};  // unit, out of the solid; for a sheet, towards the point
  double distance = 0.0;   // along the normal (unit: meter); negative inside a solid
  std::uint32_t element = 0;
};

// The nearest place of the surface within `radius` of the point (body frame). `known` is the point's normal
// at an earlier query, or zero. If the point is still on the side of `known`, inside() is not evaluated; on
// the surface itself, `known` is kept. False if nothing is within `radius`, or no normal exists.
[[nodiscard]] bool signed_distance(const RigidSurface& surface, const glm::dvec3& point, double radius,
                                   const glm::dvec3& known, SignedDistance& out) noexcept;

}  // namespace polygon
