// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/loop/linear_flow.h"

#include <cmath>

namespace device {
namespace {

// Taylor series of g about 0, with p = d/m and q = k/m. It is used for short times, where the closed forms
// are differences of nearly equal numbers.
LinearFlow short_flow(double p, double q, double t) noexcept {
  constexpr int kTerms = 24;      // terms of at most (1/2)^n / n!: far below rounding
  double before = 0.0, term = t;  // t^n times the coefficient of g, for n = 0 and 1
  LinearFlow flow{
      .time_s = t, .from_velocity_s = t, .velocity_factor = 1.0, .from_acceleration_s2 = 0.5 * t * t};
  for (int n = 0; n < kTerms; ++n) {
    const double next = -(p * t * (n + 1) * term + q * t * t * before) / ((n + 2) * (n + 1));
    before = term;
    term = next;
    flow.from_velocity_s += term;
    flow.velocity_factor += (n + 2) * term / t;
    flow.from_acceleration_s2 += term * t / (n + 3);
  }
  return flow;
}

// ∫ e^(λ·s) ds from 0 to t.
double sum_of_exp(double lambda, double t) noexcept {
  return lambda != 0.0 ? std::expm1(lambda * t) / lambda : t;
}

// sinh(x)/x and cosh(x) for x² = square, which may be negative (sin, cos), |square| <= 1.
void hyperbolic(double square, double& sinh_by_x, double& cosh) noexcept {
  double odd = 1.0, even = 1.0;
  sinh_by_x = cosh = 1.0;
  for (int n = 1; n <= 10; ++n) {
    even *= square / ((2 * n) * (2 * n - 1));
    odd *= square / ((2 * n + 1) * (2 * n));
    cosh += even;
    sinh_by_x += odd;
  }
}

}  // namespace

LinearFlow linear_flow(double mass_kg, double damping_N_s_per_m, double stiffness_N_per_m,
                       double time_s) noexcept {
  const double p = damping_N_s_per_m / mass_kg, q = stiffness_N_per_m / mass_kg, t = time_s;
  if (!(t > 0.0)) return {.time_s = 0.0};
  if (p * t + q * t * t <= 0.5) return short_flow(p, q, t);

  LinearFlow flow{.time_s = t};
  const double alpha = 0.5 * p;
  const double split = alpha * alpha - q;  // above 0 overdamped, below 0 oscillating
  // Near critical damping the two roots nearly coincide. The second condition excludes a very weak spring:
  // there the damping is not near critical, and `split`·t² is small only because the time is short.
  if (std::abs(split) * t * t <= 1.0 && q * t * t > 0.01) {
    double sinh_by_x = 1.0, cosh = 1.0;
    hyperbolic(split * t * t, sinh_by_x, cosh);
    const double fade = std::exp(-alpha * t);
    flow.from_velocity_s = fade * t * sinh_by_x;
    flow.velocity_factor = fade * (cosh - alpha * t * sinh_by_x);
    flow.from_acceleration_s2 = (1.0 - flow.velocity_factor - p * flow.from_velocity_s) / q;
  } else if (split > 0.0) {
    const double delta = std::sqrt(split);
    const double fast = -(alpha + delta), slow = q / fast;  // fast · slow = q, so nothing cancels
    const double gap = 2.0 * delta;
    flow.from_velocity_s = (std::exp(slow * t) - std::exp(fast * t)) / gap;
    flow.velocity_factor = (slow * std::exp(slow * t) - fast * std::exp(fast * t)) / gap;
    flow.from_acceleration_s2 = (sum_of_exp(slow, t) - sum_of_exp(fast, t)) / gap;
  } else {
    const double omega = std::sqrt(-split);
    const double fade = std::exp(-alpha * t);
    flow.from_velocity_s = fade * std::sin(omega * t) / omega;
    flow.velocity_factor = fade * std::cos(omega * t) - alpha * flow.from_velocity_s;
    flow.from_acceleration_s2 = (1.0 - flow.velocity_factor - p * flow.from_velocity_s) / q;
  }
  return flow;
}

}  // namespace device
