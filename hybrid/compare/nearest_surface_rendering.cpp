// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/compare/nearest_surface_rendering.h"

#include <glm/geometric.hpp>

namespace hybrid {

ClassicForce nearest_surface_force(const polygon::RigidSurface& surface, const Pose& pose,
                                   const glm::dvec3& device_m, double radius_m,
                                   double stiffness_N_per_m) noexcept {
  ClassicForce out{.surface_m = device_m};
  const glm::dvec3 p = glm::inverse(pose.rotation) * (device_m - pose.position_m);
  const bool inside = surface.inside(p);
  // From inside there is always a way out. It is no longer than the diagonal of the object's box.
  const double reach = inside ? glm::length(surface.upper() - surface.lower()) : radius_m;
  polygon::NearPoint near;
  if (!surface.nearest(p, reach, near)) return out;
  const glm::dvec3 away = inside ? near.point - p : p - near.point;
  const double distance = glm::length(away);
  const double depth = inside ? radius_m + distance : radius_m - distance;
  if (!(depth > 0.0)) return out;
  out.surface_m = pose.position_m + pose.rotation * near.point;
  out.contact = true;
  // On the surface itself the distance is 0. Then this model has no direction, and so no force.
  if (distance > 0.0) out.force_N = (stiffness_N_per_m * depth / distance) * (pose.rotation * away);
  return out;
}

}  // namespace hybrid
