// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/loop/loop_theory.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <unsupported/Eigen/MatrixFunctions>

namespace device {
namespace {

// Position and velocity after one period, from those before and a force held meanwhile.
struct HeldForce {
  Eigen::Matrix2d state;
  Eigen::Vector2d force;
};

HeldForce sample_mechanics(const SampledLoop& loop) {
  Eigen::Matrix3d rate = Eigen::Matrix3d::Zero();  // of (x, v, u), u constant
  rate(0, 1) = 1.0;
  rate(1, 0) = -loop.hand_stiffness_N_per_m / loop.mass_kg;
  rate(1, 1) = -loop.damping_N_s_per_m / loop.mass_kg;
  rate(1, 2) = 1.0 / loop.mass_kg;
  const Eigen::Matrix3d map = (rate * loop.period_s).exp();
  return {map.topLeftCorner<2, 2>(), map.topRightCorner<2, 1>()};
}

double radius_of(const SampledLoop& loop, const HeldForce& held, double stiffness) {
  // (x(k), v(k), x(k−1), u(k−1), …, u(k−delay)); the wall's law makes u(k).
  const Eigen::Index delay = std::max(loop.delay_ticks, 0), size = 3 + delay;
  const double b = loop.wall_damping_N_s_per_m / loop.period_s;
  Eigen::RowVectorXd law = Eigen::RowVectorXd::Zero(size);
  law(0) = -stiffness - b;
  law(2) = b;
  Eigen::MatrixXd map = Eigen::MatrixXd::Zero(size, size);
  map.topLeftCorner<2, 2>() = held.state;
  map(2, 0) = 1.0;
  if (delay == 0) {
    map.topRows<2>() += held.force * law;
  } else {
    map.block<2, 1>(0, size - 1) = held.force;  // the oldest is the one played
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
  constexpr double kStep = 1.05;  // of the search: the least boundary is wanted, not any
  const HeldForce held = sample_mechanics(loop);
  const double unit = loop.mass_kg / (loop.period_s * loop.period_s);
  double stable = 1e-6 * unit;
  if (!(radius_of(loop, held, stable) < 1.0)) return 0.0;
  double unstable = stable * kStep;
  // Near m/T² at most where the mass decides; where the damping outweighs it, near 2b/T, without a bound in
  // m/T².
  while (radius_of(loop, held, unstable) < 1.0 && unstable < 1e6 * unit) {
    stable = unstable;
    unstable *= kStep;
  }
  while (unstable - stable > 1e-9 * unstable) {
    const double middle = 0.5 * (stable + unstable);
    (radius_of(loop, held, middle) < 1.0 ? stable : unstable) = middle;
  }
  return stable;
}

double passive_damping_at(const SampledLoop& loop, double stiffness_N_per_m, double theta_rad) {
  // Re{(1 − z⁻¹)·z^(−d)} = cos dθ − cos (d+1)θ, and once more for the difference of B. Divided by 1 − cos θ;
  // written as products of sines, which lose nothing at small θ.
  const double half = std::sin(0.5 * theta_rad), d = std::max(loop.delay_ticks, 0);
  const double spring = std::sin((d + 0.5) * theta_rad) / half;
  const double damper = -2.0 * std::cos((d + 1.0) * theta_rad);
  return 0.5 * loop.period_s * stiffness_N_per_m * spring + 0.5 * loop.wall_damping_N_s_per_m * damper;
}

double passive_damping(const SampledLoop& loop, double stiffness_N_per_m) {
  constexpr int kAngles = 4096;  // a polynomial of degree delay + 1 in cos θ: its top is met to 1e-6
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
