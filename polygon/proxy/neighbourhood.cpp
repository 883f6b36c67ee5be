// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/proxy/neighbourhood.h"

#include <algorithm>
#include <cmath>

#include "polygon/mesh/simd_dispatch.h"

namespace polygon {
namespace {

HYBRID_WIDE double measure(const double* x, const double* y, const double* z, const double* offset, double px,
                           double py, double pz, double* depth, std::uint32_t count) noexcept {
  // Four maxima side by side: one would wait for itself.
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
    : x_(std::min<std::size_t>(elements, kCrowded)),
      y_(x_.size()),
      z_(x_.size()),
      offset_(x_.size()),
      depth_(x_.size()),
      element_(x_.size()),
      seen_(x_.size()),
      broken_(x_.size()) {}

void Neighbourhood::set_plane(std::uint32_t i, const SeparatingPlane& plane) noexcept {
  x_[i] = plane.normal.x;
  y_[i] = plane.normal.y;
  z_[i] = plane.normal.z;
  offset_[i] = plane.offset;
}

bool Neighbourhood::survey(const RigidSurface& surface, const glm::dvec3& centre, double margin,
                           double radius, const glm::dvec3& view, bool crowded) noexcept {
  std::span<SeenElement> room(seen_);
  if (!crowded && room.size() > kCapacity) room = room.first(kCapacity);
  const GatherResult result = surface.survey(centre, radius + margin, view, room);
  if (!result.complete) {
    forget();
    return false;
  }
  centre_ = centre;
  margin_ = margin;
  count_ = result.count;
  for (std::uint32_t i = 0; i < count_; ++i) {
    const SeenElement& seen = seen_[i];
    element_[i] = seen.element;
    // Too near for a rough plane to pass between: an exact one.
    const bool clear = glm::dot(seen.normal, view) >= seen.reach + radius;
    set_plane(i, clear ? SeparatingPlane{seen.normal, seen.reach + radius}
                       : separate(surface, seen.element, view, radius));
  }
  return true;
}

void Neighbourhood::see_from(const RigidSurface& surface, const glm::dvec3& view, double radius,
                             double rounding) noexcept {
  if (!known()) return;
  const double deepest =
      measure(x_.data(), y_.data(), z_.data(), offset_.data(), view.x, view.y, view.z, depth_.data(), count_);
  if (!(deepest > rounding)) return;
  for (std::uint32_t i = 0; i < count_; ++i) {
    if (depth_[i] > rounding) set_plane(i, separate(surface, element_[i], view, radius));
  }
}

std::span<Neighbourhood::Broken> Neighbourhood::broken(const glm::dvec3& from, const glm::dvec3& to,
                                                       double tolerance) noexcept {
  const double deepest =
      measure(x_.data(), y_.data(), z_.data(), offset_.data(), to.x, to.y, to.z, depth_.data(), count_);
  if (!(deepest > tolerance)) return {};
  std::size_t count = 0;
  for (std::uint32_t i = 0; i < count_; ++i) {
    if (!(depth_[i] > tolerance)) continue;
    broken_[count++] = {part_before(plane(i), from, to), i, false};
  }
  return {broken_.data(), count};
}

SeparatingPlane separate(const RigidSurface& surface, std::uint32_t element, const glm::dvec3& view,
                         double radius) noexcept {
  const NearPoint near = surface.closest(element, view);
  if (!(near.distance > 0.0)) return {};  // fulfilled everywhere: its neighbours decide
  const glm::dvec3 normal = (view - near.point) / near.distance;
  // By the element's furthest corner, not by the closest point: so near a surface, rounding turns the normal,
  // and over a long triangle that is more than the distance.
  const double reach = surface.support(element, normal);
  return {normal, (std::isfinite(reach) ? reach : glm::dot(normal, near.point)) + radius};
}

bool separate_flatly(const RigidSurface& surface, std::uint32_t element, const glm::dvec3& view,
                     double radius, double rounding, SeparatingPlane& plane) noexcept {
  const glm::dvec3 normal = surface.face_normal(element);
  if (normal == glm::dvec3(0.0)) return false;
  // The whole element lies in its plane: the furthest of its corners along either side is on it.
  const double level = surface.support(element, normal);
  const double height = glm::dot(normal, view) - level;
  if (!(std::abs(height) >= radius - rounding) || height == 0.0) return false;
  plane = height > 0.0 ? SeparatingPlane{normal, level + radius}
                       : SeparatingPlane{-normal, surface.support(element, -normal) + radius};
  return true;
}

}  // namespace polygon
