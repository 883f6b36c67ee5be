// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/surface/signed_distance.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace polygon {
namespace {

// Distance from the surface, relative to the largest coordinate. Below it the direction from the surface to
// the point is rounding error.
constexpr double kOnSurface = 1e-13;

}  // namespace

bool signed_distance(const RigidSurface& surface, const glm::dvec3& point, double radius,
                     const glm::dvec3& known, SignedDistance& out) noexcept {
  NearPoint near;
  if (!surface.nearest(point, radius, near)) return false;
  // From inside a solid primitive nearest() reports distance 0, whatever the radius, so the distance is
  // checked here.
  const glm::dvec3 away = point - near.point;
  const double length = glm::length(away);
  if (!(length <= radius)) return false;
  out.element = near.element;
  const glm::dvec3 size = glm::max(glm::abs(point), glm::abs(near.point));
  if (length <= kOnSurface * std::max({size.x, size.y, size.z})) {
    out.distance = 0.0;
    out.normal = known != glm::dvec3(0.0) ? known : surface.face_normal(near.element);
    return out.normal != glm::dvec3(0.0);
  }
  const bool seen_before = known != glm::dvec3(0.0) && glm::dot(away, known) > 0.0;
  const bool within = !seen_before && surface.inside(point);
  out.normal = within ? -away / length : away / length;
  out.distance = within ? -length : length;
  return true;
}

}  // namespace polygon
