// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/reference/near_triangle.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace polygon {
namespace {

constexpr FineReal kNoArea = 1e-14L;  // sine of the angle between two sides

}  // namespace

FineVec unit(const FineVec& v) {
  const FineReal length = glm::length(v);
  return length > 0.0L ? v / length : FineVec(0.0L);
}

NearTriangle near_triangle(std::uint32_t id, const std::array<glm::dvec3, 3>& corners,
                           const glm::dvec3& origin) {
  NearTriangle t;
  t.id = id;
  for (std::size_t i = 0; i < 3; ++i) t.corner[i] = FineVec(corners[i]) - FineVec(origin);
  for (std::size_t i = 0; i < 3; ++i) {
    const FineVec side = t.corner[(i + 1) % 3] - t.corner[i];
    t.length[i] = glm::length(side);
    t.side[i] = unit(side);
  }
  const FineVec n = glm::cross(t.side[0], t.side[1]);
  t.has_area = glm::length(n) > kNoArea && glm::length(glm::cross(t.side[1], t.side[2])) > kNoArea;
  if (t.has_area) t.normal = unit(n);
  t.distance = closest_on(t, FineVec(0.0L)).distance;
  return t;
}

ClosestPoint closest_on_side(const NearTriangle& t, std::size_t i, const FineVec& x) {
  const FineReal along = std::clamp(glm::dot(x - t.corner[i], t.side[i]), 0.0L, t.length[i]);
  const FineVec point = t.corner[i] + along * t.side[i];
  return {point, glm::length(x - point)};
}

ClosestPoint closest_on(const NearTriangle& t, const FineVec& x) {
  bool within = t.has_area;
  for (std::size_t i = 0; i < 3 && within; ++i) {
    within = glm::dot(t.normal, glm::cross(t.side[i], x - t.corner[i])) >= 0.0L;
  }
  if (within) {
    const FineReal height = glm::dot(t.normal, x - t.corner[0]);
    return {x - height * t.normal, std::abs(height)};
  }
  ClosestPoint best = closest_on_side(t, 0, x);
  for (std::size_t i = 1; i < 3; ++i) {
    const ClosestPoint other = closest_on_side(t, i, x);
    if (other.distance < best.distance) best = other;
  }
  return best;
}

}  // namespace polygon
