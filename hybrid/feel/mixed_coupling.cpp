// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/feel/mixed_coupling.h"

#include <algorithm>
#include <cmath>

namespace hybrid {
namespace {

// The proxy's metric must not vanish where there is no energy for a force.
constexpr double kLeastForceShare = 1e-9;  // of stiffness · depth
// A force that lacks less than this share of stiffness · depth lacks it by rounding.
constexpr double kRounding = 1e-9;

double spring_J(double stiffness_N_per_m, double force_N) noexcept {
  return 0.5 * force_N * force_N / stiffness_N_per_m;
}

// The largest force F whose spring energy F²/2k is at most given + ½ F · way: the energy after the tick, in
// which the hand also works against F.
double most_force(double stiffness_N_per_m, double given_J, double way_m) noexcept {
  const double half = 0.5 * stiffness_N_per_m * way_m;
  return half + std::sqrt(std::max(0.0, half * half + 2.0 * stiffness_N_per_m * given_J));
}

}  // namespace

double mean_stiffness(std::span<const ObjectStiffness> objects, double otherwise_N_per_m) noexcept {
  double whole_N = 0.0, sum = 0.0;
  for (const ObjectStiffness& object : objects) {
    whole_N += object.force_N;
    sum += object.force_N * object.stiffness_N_per_m;
  }
  return whole_N > 0.0 ? sum / whole_N : otherwise_N_per_m;
}

void update(MixedCoupling& coupling, double depth_m, double wanted_N_per_m, double stiffest_N_per_m,
            double dt_s) noexcept {
  if (!(depth_m > 0.0) || !std::isfinite(depth_m)) {
    coupling = {};
    return;
  }
  if (!coupling.pressed()) {
    const double force_N = wanted_N_per_m * depth_m;
    coupling = {wanted_N_per_m, depth_m, force_N, spring_J(wanted_N_per_m, force_N), wanted_N_per_m};
    return;
  }
  const double step = stiffest_N_per_m * std::min(1.0, dt_s / kStiffnessChange_s);
  const double k =
      coupling.stiffness_N_per_m + std::clamp(wanted_N_per_m - coupling.stiffness_N_per_m, -step, step);
  const double way = depth_m - coupling.depth_m, whole_N = k * depth_m;
  const double given_J = coupling.energy_J + 0.5 * coupling.force_N * way;
  const double most_N = most_force(k, given_J, way);
  const double force_N = whole_N <= most_N * (1.0 + kRounding) ? whole_N : std::max(0.0, most_N);
  // More energy than the stiffest object stores at this depth is never needed.
  const double least_J = spring_J(k, force_N), most_J = 0.5 * stiffest_N_per_m * depth_m * depth_m;
  const double energy_J = std::max(least_J, std::min(given_J + 0.5 * force_N * way, most_J));
  coupling = {k, depth_m, force_N, energy_J, k * std::max(kLeastForceShare, force_N / whole_N)};
}

}  // namespace hybrid
