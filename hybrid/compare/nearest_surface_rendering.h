// SPDX-License-Identifier: GPL-3.0-or-later
// Rigid surfaces without a proxy, as they were felt before there was one (thesis, Fig 18): the force points
// to the surface nearest to the device now. For comparison only: it forgets which side the tool came from.
#pragma once

#include "hybrid/scene/scene.h"
#include "polygon/surface/rigid_surface.h"

namespace hybrid {

struct ClassicForce {
  glm::dvec3 force_N{0.0};    // scene frame
  glm::dvec3 surface_m{0.0};  // nearest point of the surface, scene frame; the device's own without contact
  bool contact = false;
};

// A ball of `radius_m` at the device, which may lie anywhere in the object. Outside a solid, and by a sheet,
// F = K·(radius − distance) away from the nearest point; inside a solid, F = K·(radius + distance) towards
// it. On the surface of a solid both agree: F = K·radius outward. On a sheet they are opposite: F = 0.
ClassicForce nearest_surface_force(const polygon::RigidSurface& surface, const Pose& pose,
                                   const glm::dvec3& device_m, double radius_m,
                                   double stiffness_N_per_m) noexcept;

}  // namespace hybrid
