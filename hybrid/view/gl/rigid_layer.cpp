// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/gl/rigid_layer.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_access.hpp>

namespace hybrid {
namespace {

constexpr double kRangeStep = 1.5;  // ratio of two radii of the range of depths

}  // namespace

double rounded_up(double radius, double least) {
  if (!(radius > least)) return least;
  return least * std::pow(kRangeStep, std::ceil(std::log(radius / least) / std::log(kRangeStep)));
}

// Row 3 of the matrix is minus the rigid transform's third row, and row 2 is that row times -p, plus q. A
// point at distance D from the eye's plane has the depth d with 2 d - 1 = q / D - p.
glm::vec2 depth_further(const glm::dmat4& clip_from_scene, double by_m) {
  const glm::dvec4 depth = glm::row(clip_from_scene, 2), away = glm::row(clip_from_scene, 3);
  const double p =
      -glm::dot(glm::dvec3(depth), glm::dvec3(away)) / glm::dot(glm::dvec3(away), glm::dvec3(away));
  const double q = depth.w + p * away.w;
  return {0.5 * (p - 1.0), -2.0 * by_m / q};
}

}  // namespace hybrid
