// SPDX-License-Identifier: GPL-3.0-or-later
// Rigid surfaces without a proxy, as they were rendered before proxies (thesis, Fig 18). The force points to
// the surface that is nearest to the device now. For comparison only. The model forgets from which side the
// tool came.
#pragma once

#include "hybrid/scene/scene.h"
#include "polygon/surface/rigid_surface.h"

namespace hybrid {

struct ClassicForce {
  glm::dvec3 force_N{0.0};  // scene's frame
  // Nearest point of the surface, scene's frame; without contact the device's position.
  glm::dvec3 surface_m{0.0};
  bool contact = false;
};

// Force of the object on a ball of `radius_m` at the device, which may lie anywhere in the object. Outside a
// solid and beside a sheet, F = K·(radius − distance), away from the nearest point. Inside a solid, F =
// K·(radius + distance), towards the nearest point.
ClassicForce nearest_surface_force(const polygon::RigidSurface& surface, const Pose& pose,
                                   const glm::dvec3& device_m, double radius_m,
                                   double stiffness_N_per_m) noexcept;

}  // namespace hybrid
