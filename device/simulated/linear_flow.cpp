// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/simulated/linear_flow.h"

#include <cmath>

namespace device {
namespace {

// p = d/m, q = k/m. Taylor's series of g about 0: its closed forms are differences of nearly equal numbers
// when little happens in the time.
LinearFlow short_flow(double p, double q, double t) noexcept {
  constexpr int kTerms = 24;      // of at most 1/2 to the n over n!: far below rounding
  double before = 0.0, term = t;  // t^n times the coefficients of g, n = 0 and 1
  LinearFlow flow{.time_s = t, .from_speed_s = t, .keep = 1.0, .from_pull_s2 = 0.5 * t * t};
  for (int n = 0; n < kTerms; ++n) {
    const double next = -(p * t * (n + 1) * term + q * t * t * before) / ((n + 2) * (n + 1));
    before = term;
    term = next;
    flow.from_speed_s += term;
    flow.keep += (n + 2) * term / t;
    flow.from_pull_s2 += term * t / (n + 3);
  }
  return flow;
}

// ∫ e^(λ·s) ds from 0 to t.
double sum_of_exp(double lambda, double t) noexcept {
  return lambda != 0.0 ? std::expm1(lambda * t) / lambda : t;
}

// sinh(x)/x and cosh(x) of x² = square, which may be negative (sin, cos), for |square| <= 1.
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
  const double split = alpha * alpha - q;  // overdamped above 0, oscillating below
  // Near critical damping both roots are nearly one. (With hardly a spring it is not near: only short.)
  if (std::abs(split) * t * t <= 1.0 && q * t * t > 0.01) {
    double sinh_by_x = 1.0, cosh = 1.0;
    hyperbolic(split * t * t, sinh_by_x, cosh);
    const double fade = std::exp(-alpha * t);
    flow.from_speed_s = fade * t * sinh_by_x;
    flow.keep = fade * (cosh - alpha * t * sinh_by_x);
    flow.from_pull_s2 = (1.0 - flow.keep - p * flow.from_speed_s) / q;
  } else if (split > 0.0) {
    const double delta = std::sqrt(split);
    const double fast = -(alpha + delta), slow = q / fast;  // their product is q: nothing is subtracted
    const double gap = 2.0 * delta;
    flow.from_speed_s = (std::exp(slow * t) - std::exp(fast * t)) / gap;
    flow.keep = (slow * std::exp(slow * t) - fast * std::exp(fast * t)) / gap;
    flow.from_pull_s2 = (sum_of_exp(slow, t) - sum_of_exp(fast, t)) / gap;
  } else {
    const double omega = std::sqrt(-split);
    const double fade = std::exp(-alpha * t);
    flow.from_speed_s = fade * std::sin(omega * t) / omega;
    flow.keep = fade * std::cos(omega * t) - alpha * flow.from_speed_s;
    flow.from_pull_s2 = (1.0 - flow.keep - p * flow.from_speed_s) / q;
  }
  return flow;
}

}  // namespace device
