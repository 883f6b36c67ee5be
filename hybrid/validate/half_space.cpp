// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/validate/half_space.h"

#include <cmath>
#include <numbers>

#include "hybrid/validate/specimen.h"

namespace hybrid {
namespace {

constexpr double kDepthInRadii = 10.0;  // depth of the block, in radii of the contact

}  // namespace

double hertz_N(double young_Pa, double poisson, double radius_m, double depth_m) {
  return 4.0 / 3.0 * young_Pa / (1.0 - poisson * poisson) * std::sqrt(radius_m) * std::pow(depth_m, 1.5);
}

double bonded_layer_factor(double poisson, double share) {
  constexpr double pi = std::numbers::pi;
  const double alpha = -(1.2876 - 1.4678 * poisson + 1.3442 * poisson * poisson) / (1.0 - poisson);
  const double beta = (0.6387 - 1.0277 * poisson + 1.5164 * poisson * poisson) / (1.0 - poisson);
  const double x = share;
  return 1.0 - 2.0 * alpha / pi * x + 4.0 * alpha * alpha / (pi * pi) * x * x -
         8.0 / std::pow(pi, 3) * (std::pow(alpha, 3) + 4.0 * pi * pi / 15.0 * beta) * std::pow(x, 3);
}

double half_space_factor(Energy energy, double poisson, double depth_per_radius, int nodes) {
  const double contact = nodes;  // radius of the contact; the spacing is 1
  const double radius = contact / std::sqrt(depth_per_radius), depth = radius * depth_per_radius;
  const double deep = kDepthInRadii * contact;
  PressedSpecimen block(
      {.size_m = {2.0 * deep, 2.0 * deep, deep}, .spacing_m = 1.0, .energy = energy, .poisson = poisson});
  return block.on_ball_N(radius, depth) / hertz_N(1.0, poisson, radius, depth) /
         bonded_layer_factor(poisson, 1.0 / kDepthInRadii);
}

}  // namespace hybrid
