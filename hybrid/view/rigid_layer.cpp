// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/rigid_layer.h"

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

std::optional<ViewPart> part_with_disc(const glm::mat4& clip, const glm::mat4& placed_disc,
                                       const PixelRect& pixels) {
  glm::vec2 low(1.0F), high(-1.0F);
  for (const float x : {-1.0F, 1.0F}) {
    for (const float y : {-1.0F, 1.0F}) {
      const glm::vec4 at = clip * placed_disc * glm::vec4(x, y, 0.0F, 1.0F);
      if (!(at.w > 0.0F)) return {};
      low = glm::min(low, glm::vec2(at) / at.w);
      high = glm::max(high, glm::vec2(at) / at.w);
    }
  }
  low = glm::clamp(low, -1.0F, 1.0F);
  high = glm::clamp(high, -1.0F, 1.0F);
  const glm::vec2 size(pixels.width, pixels.height);
  const glm::vec2 from = glm::floor((0.5F * low + 0.5F) * size), to = glm::ceil((0.5F * high + 0.5F) * size);
  if (!(to.x > from.x && to.y > from.y)) return {};
  ViewPart part{.pixels = {pixels.x + static_cast<int>(from.x), pixels.y + static_cast<int>(from.y),
                           static_cast<int>(to.x - from.x), static_cast<int>(to.y - from.y)}};
  const glm::vec2 first = 2.0F * from / size - 1.0F, last = 2.0F * to / size - 1.0F;
  for (int d = 0; d < 2; ++d) {
    part.whole_from_clip[d][d] = 2.0F / (last[d] - first[d]);
    part.whole_from_clip[3][d] = -(last[d] + first[d]) / (last[d] - first[d]);
  }
  return part;
}

}  // namespace hybrid
