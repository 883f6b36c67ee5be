// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/proxy/neighbourhood.h"

#include <algorithm>
#include <cmath>

#include "polygon/mesh/simd_dispatch.h"

namespace polygon {
namespace {

// Depth of the point p below each plane; returns the largest.
HYBRID_MULTIVERSIONED double plane_depths(const double* x, const double* y, const double* z,
                                          const double* offset, double px, double py, double pz,
                                          double* depth, std::uint32_t count) noexcept {
  // Four independent maxima, because a single one would serialise the loop.
  double most[4] = {-1e300, -1e300, -1e300, -1e300};
  const std::uint32_t whole = count & ~3U;
  for (std::uint32_t i = 0; i < whole; i += 4) {
    for (std::uint32_t k = 0; k < 4; ++k) {
      const double d = offset[i + k] - (x[i + k] * px + y[i + k] * py + z[i + k] * pz);
      depth[i + k] = d;
      most[k] = d > most[k] ? d : most[k];
    }
  }
  double deepest = std::max(std::max(most[0], most[1]), std::max(most[2], most[3]));
  for (std::uint32_t i = whole; i < count; ++i) {
    depth[i] = offset[i] - (x[i] * px + y[i] * py + z[i] * pz);
    deepest = std::max(deepest, depth[i]);
  }
  return deepest;
}

}  // namespace

Neighbourhood::Neighbourhood(std::size_t elements)
    : x_(std::min<std::size_t>(elements, kCrowdedCapacity)),
      y_(x_.size()),
      z_(x_.size()),
      offset_(x_.size()),
      depth_(x_.size()),
      element_(x_.size()),
      surveyed_(x_.size()),
      violations_(x_.size()) {}

void Neighbourhood::set_plane(std::uint32_t i, const SeparatingPlane& plane) noexcept {
  x_[i] = plane.normal.x;
  y_[i] = plane.normal.y;
  z_[i] = plane.normal.z;
  offset_[i] = plane.offset;
}

bool Neighbourhood::survey(const RigidSurface& surface, const glm::dvec3& centre, double margin,
                           double radius, const glm::dvec3& view, std::uint32_t most) noexcept {
  const std::span<ElementPlane> room(surveyed_.data(), std::min<std::size_t>(most, surveyed_.size()));
  const GatherResult result = surface.survey(centre, radius + margin, view, room);
  if (!result.complete) {
    forget();
    return false;
  }
  centre_ = centre;
  margin_ = margin;
  count_ = result.count;
  for (std::uint32_t i = 0; i < count_; ++i) {
    const ElementPlane& candidate = surveyed_[i];
    element_[i] = candidate.element;
    // Too near for the approximate plane: use the exact one.
    const bool clear = glm::dot(candidate.normal, view) >= candidate.support + radius;
    set_plane(i, clear ? SeparatingPlane{candidate.normal, candidate.support + radius}
                       : separating_plane(surface, candidate.element, view, radius));
  }
  return true;
}

void Neighbourhood::refresh_planes(const RigidSurface& surface, const glm::dvec3& view, double radius,
                                   double rounding) noexcept {
  if (!known()) return;
  const double deepest = plane_depths(x_.data(), y_.data(), z_.data(), offset_.data(), view.x, view.y, view.z,
                                      depth_.data(), count_);
  if (!(deepest > rounding)) return;
  for (std::uint32_t i = 0; i < count_; ++i) {
    if (depth_[i] > rounding) set_plane(i, separating_plane(surface, element_[i], view, radius));
  }
}

std::span<Neighbourhood::Violation> Neighbourhood::violated(const glm::dvec3& from, const glm::dvec3& to,
                                                            double tolerance) noexcept {
  const double deepest =
      plane_depths(x_.data(), y_.data(), z_.data(), offset_.data(), to.x, to.y, to.z, depth_.data(), count_);
  if (!(deepest > tolerance)) return {};
  std::size_t count = 0;
  for (std::uint32_t i = 0; i < count_; ++i) {
    if (!(depth_[i] > tolerance)) continue;
    violations_[count++] = {fraction_before(plane(i), from, to), i, false};
  }
  return {violations_.data(), count};
}

SeparatingPlane separating_plane(const RigidSurface& surface, std::uint32_t element, const glm::dvec3& view,
                                 double radius) noexcept {
  const NearPoint near = surface.closest(element, view);
  if (!(near.distance > 0.0)) return {};  // a plane that all points satisfy; other elements decide
  const glm::dvec3 normal = (view - near.point) / near.distance;
  // The offset comes from the element's support and not from the closest point. Close to the surface the
  // normal has a rounding error, which over a long triangle exceeds the distance.
  const double support = surface.support(element, normal);
  return {normal, (std::isfinite(support) ? support : glm::dot(normal, near.point)) + radius};
}

bool separating_face_plane(const RigidSurface& surface, std::uint32_t element, const glm::dvec3& view,
                           double radius, double rounding, SeparatingPlane& plane) noexcept {
  const glm::dvec3 normal = surface.face_normal(element);
  if (normal == glm::dvec3(0.0)) return false;
  // All corners of a flat element have the same height along its normal.
  const double level = surface.support(element, normal);
  const double height = glm::dot(normal, view) - level;
  if (!(std::abs(height) >= radius - rounding) || height == 0.0) return false;
  plane = height > 0.0 ? SeparatingPlane{normal, level + radius}
                       : SeparatingPlane{-normal, surface.support(element, -normal) + radius};
  return true;
}

}  // namespace polygon
