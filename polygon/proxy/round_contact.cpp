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

// A goal from which the surface turns away as fast as it draws nearer has no minimum there: the model is kept
// this far from flat.
constexpr double kFlattest = 1.0 / 64.0;

// Two unit vectors across n, and each other.
std::array<glm::dvec3, 2> across(const glm::dvec3& n) noexcept {
  const glm::dvec3 some = std::abs(n.x) < 0.6 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
  const glm::dvec3 first = glm::normalize(glm::cross(n, some));
  return {first, glm::cross(n, first)};
}

}  // namespace

glm::dmat3 turning_of(const RigidSurface& surface, std::uint32_t element, const glm::dvec3& view,
                      double step) noexcept {
  const NearPoint here = surface.closest(element, view);
  if (!(here.distance > 0.0)) return glm::dmat3(0.0);
  const glm::dvec3 normal = (view - here.point) / here.distance;
  glm::dmat3 turning(0.0);
  for (const glm::dvec3& side : across(normal)) {
    // The closest point goes along with the view over a face, along an edge only along it, from a corner
    // nowhere.
    const glm::dvec3 carried = (surface.closest(element, view + step * side).point - here.point) / step;
    glm::dvec3 turned = (side - carried) / here.distance;
    turned -= glm::dot(turned, normal) * normal;
    turning += glm::outerProduct(turned, side);
  }
  return 0.5 * (turning + glm::transpose(turning));
}

glm::dvec3 minimum_on_turning_planes(const glm::dvec3& from, const glm::dvec3& minimum,
                                     const glm::dmat3& metric, std::span<const TurningPlane> planes,
                                     double furthest) noexcept {
  if (planes.empty() || planes.size() > 2) return minimum;
  std::array<glm::dvec3, 2> way{};
  if (planes.size() == 1) {
    way = across(planes[0].normal);
  } else {
    const glm::dvec3 line = glm::cross(planes[0].normal, planes[1].normal);
    const double sine = glm::length(line);
    if (!(sine > 0.0)) return minimum;
    way[0] = line / sine;  // and nowhere else
  }
  glm::dmat3 turning(0.0);
  for (const TurningPlane& plane : planes) turning += plane.multiplier * plane.turning;
  glm::dmat2 flat(0.0), bent(0.0);
  glm::dvec2 went;
  for (int i = 0; i < 2; ++i) {
    const auto a = static_cast<std::size_t>(i);
    went[i] = glm::dot(way[a], minimum - from);
    for (int j = 0; j < 2; ++j) {
      const auto b = static_cast<std::size_t>(j);
      flat[j][i] = glm::dot(way[a], metric * way[b]);
      bent[j][i] = glm::dot(way[a], turning * way[b]);
    }
  }
  if (planes.size() == 2) flat[1][1] = 1.0;
  // The largest share of the metric that the turning takes away.
  const glm::dmat2 share = glm::inverse(flat) * bent;
  const double half = 0.5 * (share[0][0] + share[1][1]);
  const double most = half + std::sqrt(std::max(0.0, half * half - glm::determinant(share)));
  if (!(most > 0.0)) return minimum;
  if (most > 1.0 - kFlattest) bent *= (1.0 - kFlattest) / most;
  glm::dvec2 more = glm::inverse(flat - bent) * (flat * went) - went;
  const double length = glm::length(more);
  if (!std::isfinite(length)) return minimum;
  if (length > furthest) more *= furthest / length;
  return minimum + more.x * way[0] + more.y * way[1];
}

}  // namespace polygon
