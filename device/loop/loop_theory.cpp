// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/loop/loop_theory.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "device/loop/linear_flow.h"

namespace device {
namespace {

// Exact map of position and velocity over one period, under a constant force (zero-order hold).
struct SampledMechanics {
  Eigen::Matrix2d state;
  Eigen::Vector2d force;
};

SampledMechanics sample_mechanics(const SampledLoop& loop) {
  const LinearFlow flow =
      linear_flow(loop.mass_kg, loop.damping_N_s_per_m, loop.hand_stiffness_N_per_m, loop.period_s);
  const double pull_per_s2 = loop.hand_stiffness_N_per_m / loop.mass_kg;
  SampledMechanics mechanics;
  mechanics.state << 1.0 - flow.from_acceleration_s2 * pull_per_s2, flow.from_velocity_s,
      -flow.from_velocity_s * pull_per_s2, flow.velocity_factor;
  mechanics.force << flow.from_acceleration_s2 / loop.mass_kg, flow.from_velocity_s / loop.mass_kg;
  return mechanics;
}

double radius_of(const SampledLoop& loop, const SampledMechanics& mechanics, double stiffness) {
  // State (x(k), v(k), x(k−1), u(k−1), …, u(k−delay)); the control law gives u(k).
  const Eigen::Index delay = std::max(loop.delay_ticks, 0), size = 3 + delay;
  const double b = loop.wall_damping_N_s_per_m / loop.period_s;
  Eigen::RowVectorXd law = Eigen::RowVectorXd::Zero(size);
  law(0) = -stiffness - b;
  law(2) = b;
  Eigen::MatrixXd map = Eigen::MatrixXd::Zero(size, size);
  map.topLeftCorner<2, 2>() = mechanics.state;
  map(2, 0) = 1.0;
  if (delay == 0) {
    map.topRows<2>() += mechanics.force * law;
  } else {
    map.block<2, 1>(0, size - 1) = mechanics.force;  // the motors apply the oldest force
    map.row(3) = law;
    for (Eigen::Index n = 4; n < size; ++n) map(n, n - 1) = 1.0;
  }
  return map.eigenvalues().cwiseAbs().maxCoeff();
}

}  // namespace

double spectral_radius(const SampledLoop& loop, double stiffness_N_per_m) {
  return radius_of(loop, sample_mechanics(loop), stiffness_N_per_m);
}

double largest_stable_stiffness(const SampledLoop& loop) {
  constexpr double kStep = 1.05;  // factor of the search upwards, small enough to find the first boundary
  const SampledMechanics mechanics = sample_mechanics(loop);
  const double unit = loop.mass_kg / (loop.period_s * loop.period_s);
  double stable = 1e-6 * unit;
  if (!(radius_of(loop, mechanics, stable) < 1.0)) return 0.0;
  double unstable = stable * kStep;
  // If the mass dominates, the boundary is of the order of m/T² or below. If damping dominates, it is near
  // 2b/T, which may be far above m/T².
  while (radius_of(loop, mechanics, unstable) < 1.0 && unstable < 1e6 * unit) {
    stable = unstable;
    unstable *= kStep;
  }
  while (unstable - stable > 1e-9 * unstable) {
    const double middle = 0.5 * (stable + unstable);
    (radius_of(loop, mechanics, middle) < 1.0 ? stable : unstable) = middle;
  }
  return stable;
}

double passive_damping_at(const SampledLoop& loop, double stiffness_N_per_m, double theta_rad) {
  // Re{(1 − z⁻¹)·z^(−d)} = cos dθ − cos (d+1)θ; for B the factor 1 − z⁻¹ comes twice. Both are divided by
  // 1 − cos θ, and written as products of sines and cosines, which keep their digits at small θ.
  const double half = std::sin(0.5 * theta_rad), d = std::max(loop.delay_ticks, 0);
  const double spring = std::sin((d + 0.5) * theta_rad) / half;
  const double damper = -2.0 * std::cos((d + 1.0) * theta_rad);
  return 0.5 * loop.period_s * stiffness_N_per_m * spring + 0.5 * loop.wall_damping_N_s_per_m * damper;
}

double passive_damping(const SampledLoop& loop, double stiffness_N_per_m) {
  // The expression is a polynomial of degree delay + 1 in cos θ. With kAngles angles its maximum is found to
  // 1e-6.
  constexpr int kAngles = 4096;
  double most = 0.0;
  for (int n = 1; n <= kAngles; ++n) {
    const double theta = std::numbers::pi * n / kAngles;
    most = std::max(most, passive_damping_at(loop, stiffness_N_per_m, theta));
  }
  return std::max(most, passive_damping_at(loop, stiffness_N_per_m, 1e-6));
}

double largest_passive_stiffness(const SampledLoop& loop) {
  const double b = loop.damping_N_s_per_m;
  if (passive_damping(loop, 0.0) > b) return 0.0;
  double passive = 0.0, active = 2.0 * (b + std::fabs(loop.wall_damping_N_s_per_m)) / loop.period_s;
  while (active > 0.0 && passive_damping(loop, active) <= b) active *= 2.0;
  while (active - passive > 1e-6 * active) {
    const double middle = 0.5 * (passive + active);
    (passive_damping(loop, middle) <= b ? passive : active) = middle;
  }
  return passive;
}

double friction_and_quantisation_bound(double damping_N_s_per_m, double period_s, double friction_N,
                                       double quantisation_m) {
  const double sampling = 2.0 * damping_N_s_per_m / period_s;
  return quantisation_m > 0.0 ? std::min(sampling, 2.0 * friction_N / quantisation_m) : sampling;
}

}  // namespace device
