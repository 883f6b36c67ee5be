// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/proxy/round_contact.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat2x2.hpp>
#include <glm/matrix.hpp>
#include <glm/vec2.hpp>

namespace polygon {
namespace {

// The reduced Hessian of the Lagrangian is at least this fraction of the metric. Without this bound it may be
// zero or negative, and then the model has no minimum. It is zero, for example, if the goal lies on the edge
// and the metric is isotropic.
constexpr double kMinCurvature = 1.0 / 64.0;

// Two unit vectors perpendicular to n and to each other.
std::array<glm::dvec3, 2> across(const glm::dvec3& n) noexcept {
  const glm::dvec3 some = std::abs(n.x) < 0.6 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
  const glm::dvec3 first = glm::normalize(glm::cross(n, some));
  return {first, glm::cross(n, first)};
}

}  // namespace

glm::dmat3 distance_hessian(const RigidSurface& surface, std::uint32_t element, const glm::dvec3& view,
                            double step) noexcept {
  const NearPoint here = surface.closest(element, view);
  if (!(here.distance > 0.0)) return glm::dmat3(0.0);
  const glm::dvec3 normal = (view - here.point) / here.distance;
  glm::dmat3 hessian(0.0);
  for (const glm::dvec3& side : across(normal)) {
    // The closest point moves with the viewpoint over a face, along an edge only in the edge's direction, and
    // at a corner not at all.
    const glm::dvec3 carried = (surface.closest(element, view + step * side).point - here.point) / step;
    glm::dvec3 turned = (side - carried) / here.distance;
    turned -= glm::dot(turned, normal) * normal;
    hessian += glm::outerProduct(turned, side);
  }
  return 0.5 * (hessian + glm::transpose(hessian));
}

glm::dvec3 minimum_on_curved_constraints(const glm::dvec3& from, const glm::dvec3& minimum,
                                         const glm::dmat3& metric, std::span<const CurvedConstraint> planes,
                                         double furthest) noexcept {
  if (planes.empty() || planes.size() > 2) return minimum;
  std::array<glm::dvec3, 2> way{};
  if (planes.size() == 1) {
    way = across(planes[0].normal);
  } else {
    const glm::dvec3 line = glm::cross(planes[0].normal, planes[1].normal);
    const double sine = glm::length(line);
    if (!(sine > 0.0)) return minimum;
    way[0] = line / sine;  // the only free direction
  }
  glm::dmat3 hessian(0.0);
  for (const CurvedConstraint& plane : planes) hessian += plane.multiplier * plane.hessian;
  glm::dmat2 reduced_metric(0.0), reduced_hessian(0.0);
  glm::dvec2 travelled;
  for (int i = 0; i < 2; ++i) {
    const auto a = static_cast<std::size_t>(i);
    travelled[i] = glm::dot(way[a], minimum - from);
    for (int j = 0; j < 2; ++j) {
      const auto b = static_cast<std::size_t>(j);
      reduced_metric[j][i] = glm::dot(way[a], metric * way[b]);
      reduced_hessian[j][i] = glm::dot(way[a], hessian * way[b]);
    }
  }
  if (planes.size() == 2) reduced_metric[1][1] = 1.0;
  // The largest eigenvalue of the Hessian relative to the metric.
  const glm::dmat2 ratio = glm::inverse(reduced_metric) * reduced_hessian;
  const double half = 0.5 * (ratio[0][0] + ratio[1][1]);
  const double largest = half + std::sqrt(std::max(0.0, half * half - glm::determinant(ratio)));
  if (!(largest > 0.0)) return minimum;
  if (largest > 1.0 - kMinCurvature) reduced_hessian *= (1.0 - kMinCurvature) / largest;
  glm::dvec2 correction =
      glm::inverse(reduced_metric - reduced_hessian) * (reduced_metric * travelled) - travelled;
  const double length = glm::length(correction);
  if (!std::isfinite(length)) return minimum;
  if (length > furthest) correction *= furthest / length;
  return minimum + correction.x * way[0] + correction.y * way[1];
}

}  // namespace polygon
