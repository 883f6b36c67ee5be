// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/surface/signed_distance.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace polygon {
namespace {

// Of the largest coordinate: nearer to the surface than this, the difference has no direction but rounding.
constexpr double kOnSurface = 1e-13;

}  // namespace

bool signed_distance(const RigidSurface& surface, const glm::dvec3& point, double radius,
                     const glm::dvec3& known, SignedDistance& out) noexcept {
  NearPoint near;
  if (!surface.nearest(point, radius, near)) return false;
  // A solid primitive says 0 from within, and still where its surface is nearest.
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
