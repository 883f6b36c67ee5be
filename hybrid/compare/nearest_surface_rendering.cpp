// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/compare/nearest_surface_rendering.h"

#include <glm/geometric.hpp>

namespace hybrid {
namespace {

// Share of the size of the object. At a smaller distance from the surface, the direction to it is mostly
// rounding error.
constexpr double kOnSurface = 1e-12;

// Outward normal at a point of a solid's surface. A shape without flat faces has no face normal. There the
// normal is found from a point one step off the surface. The step is far above rounding, and far below a
// distance that a hand feels.
glm::dvec3 outward(const polygon::RigidSurface& surface, const polygon::NearPoint& on, double size_m) {
  constexpr double kStep = 1e-7;  // of the object's size
  const glm::dvec3 face = surface.face_normal(on.element);
  if (face != glm::dvec3(0.0)) return face;
  const glm::dvec3 centre = 0.5 * (surface.lower() + surface.upper());
  polygon::NearPoint near;
  const glm::dvec3 off = on.point + kStep * (on.point - centre);
  const bool found = surface.nearest(off, size_m, near) && near.distance > 0.0;
  return found ? (off - near.point) / near.distance : glm::dvec3(0.0);
}

}  // namespace

ClassicForce nearest_surface_force(const polygon::RigidSurface& surface, const Pose& pose,
                                   const glm::dvec3& device_m, double radius_m,
                                   double stiffness_N_per_m) noexcept {
  ClassicForce out{.surface_m = device_m};
  const glm::dvec3 p = glm::inverse(pose.rotation) * (device_m - pose.position_m);
  const bool inside = surface.inside(p);
  // From inside there is always a way out. It is no longer than the diagonal of the object's box.
  const double size = glm::length(surface.upper() - surface.lower());
  const double reach = inside ? size : radius_m;
  polygon::NearPoint near;
  if (!surface.nearest(p, reach, near)) return out;
  const glm::dvec3 away = inside ? near.point - p : p - near.point;
  const double distance = glm::length(away);
  const double depth = inside ? radius_m + distance : radius_m - distance;
  if (!(depth > 0.0)) return out;
  out.surface_m = pose.position_m + pose.rotation * near.point;
  out.contact = true;
  glm::dvec3 direction(0.0);
  if (distance > (surface.solid() ? kOnSurface * size : 0.0)) {
    direction = away / distance;
  } else if (surface.solid()) {
    direction = outward(surface, near, size);
  }  // exactly on a sheet no side is the right one: the direction stays zero
  out.force_N = stiffness_N_per_m * depth * (pose.rotation * direction);
  return out;
}

}  // namespace hybrid
