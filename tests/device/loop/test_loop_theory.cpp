// SPDX-License-Identifier: GPL-3.0-or-later
// The theory of the sampled wall against closed forms, derived by hand, and against published formulas.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>

#include "device/loop/loop_theory.h"

namespace {

using device::SampledLoop;

// Largest stable wall stiffness without delay, wall damping and hand. One period maps (x, v) by a 2×2 matrix,
// whose trace and determinant decide on stability:
//   x' = x + α·v − K·β·x,  v' = γ·v − K·α/m·x,  γ = e^(−bT/m), α = (1 − γ)·m/b, β = (T − α)/b.
// At det = 1 oscillations become unstable, and at 1 + trace + det = 0 alternating motions do.
double by_hand(double m, double b, double T) {
  const double gamma = std::exp(-b * T / m), alpha = -std::expm1(-b * T / m) * m / b, beta = (T - alpha) / b;
  const double spiral = alpha * alpha / m - gamma * beta;  // det = γ + K·(α²/m − γβ)
  const double by_spiral = spiral > 0.0 ? -std::expm1(-b * T / m) / spiral : HUGE_VAL;
  // 1 + (1 − Kβ + γ) + (γ + K·spiral) = 0
  const double flip = beta - spiral;
  const double by_flip = flip > 0.0 ? 2.0 * (1.0 + gamma) / flip : HUGE_VAL;
  return std::min(by_spiral, by_flip);
}

TEST(LoopStability, TwoByTwoByHand) {
  for (const double m : {0.01, 0.05, 0.08, 0.5}) {
    for (const double b : {0.01, 0.5, 5.0, 40.0}) {
      for (const double T : {1e-4, 1e-3, 5e-3}) {
        const double hand = by_hand(m, b, T);
        const double k =
            device::largest_stable_stiffness({.mass_kg = m, .damping_N_s_per_m = b, .period_s = T});
        EXPECT_NEAR(k / hand, 1.0, 1e-6) << "m " << m << " b " << b << " T " << T;
      }
    }
  }
}

TEST(LoopStability, AMassThatHardlyCountsLeavesAnIntegrator) {
  // x(k+1) = x(k) − (K·T/b)·x(k − d) is stable up to K·T/b = 2·sin(π / (2·(2d + 1))): 2, 1, 0.618…
  const double b = 5.0, T = 1e-3;
  for (int d = 0; d <= 4; ++d) {
    const double k = device::largest_stable_stiffness(
        {.mass_kg = 1e-7, .damping_N_s_per_m = b, .period_s = T, .delay_ticks = d});
    EXPECT_NEAR(k * T / b, 2.0 * std::sin(std::numbers::pi / (2.0 * (2 * d + 1))), 2e-4) << "delay " << d;
  }
}

TEST(LoopStability, SlowLoopsFollowGil) {
  // Gil, Sanchez, Hulin, Preusche & Hirzinger (2009): K < (b + B) / (T/2 + delay), if the mass is much larger
  // than the damping times the period.
  const double b = 0.4, T = 1e-3;
  for (const double B : {0.0, 1.0, 4.0}) {
    for (int d = 0; d <= 2; ++d) {
      const double k = device::largest_stable_stiffness({.mass_kg = 5.0,
                                                         .damping_N_s_per_m = b,
                                                         .wall_damping_N_s_per_m = B,
                                                         .period_s = T,
                                                         .delay_ticks = d});
      EXPECT_NEAR(k / ((b + B) / (0.5 * T + d * T)), 1.0, 0.01) << "B " << B << ", delay " << d;
    }
  }
}

TEST(LoopStability, WithoutAnyDampingNothingIsStable) {
  EXPECT_EQ(device::largest_stable_stiffness({.damping_N_s_per_m = 0.0}), 0.0);
}

TEST(LoopStability, TooMuchSampledDampingIsUnstableByItself) {
  EXPECT_EQ(device::largest_stable_stiffness(
                {.mass_kg = 0.05, .damping_N_s_per_m = 0.1, .wall_damping_N_s_per_m = 200.0}),
            0.0);
}

// Simulates mechanism and hand tick by tick. Within a tick the motion is the closed form of the underdamped
// oscillator.
TEST(LoopStability, RadiusIsTheRateAtWhichAMotionGrows) {
  const double m = 0.08, b = 5.0, k_hand = 600.0, T = 1e-3, decay = 0.5 * b / m;
  const double omega = std::sqrt(k_hand / m - decay * decay);
  const double e = std::exp(-decay * T), c = std::cos(omega * T), s = std::sin(omega * T) / omega;
  struct Case {
    double stiffness, wall_damping;
    int delay;
  };
  for (const Case& each :
       {Case{4000.0, 0.0, 0}, Case{12000.0, 0.0, 0}, Case{3000.0, 2.0, 1}, Case{6000.0, 1.0, 2}}) {
    const double stiffness = each.stiffness, wall_damping = each.wall_damping;
    const int delay = each.delay;
    const SampledLoop loop{.mass_kg = m,
                           .damping_N_s_per_m = b,
                           .hand_stiffness_N_per_m = k_hand,
                           .wall_damping_N_s_per_m = wall_damping,
                           .period_s = T,
                           .delay_ticks = delay};
    double x = 1e-6, v = 0.0, before = x, log_size = 0.0;
    double queue[3] = {};
    const auto run = [&](int ticks) {
      for (int n = 0; n < ticks; ++n) {
        for (int i = delay; i > 0; --i) queue[i] = queue[i - 1];
        queue[0] = -stiffness * x - wall_damping * (x - before) / T;
        before = x;
        const double rest = queue[delay] / k_hand, away = x - rest;
        x = rest + e * (away * (c + decay * s) + v * s);
        v = e * (v * (c - decay * s) - away * (k_hand / m) * s);
        if (n % 100 == 99) {  // rescaling is allowed, because the system is linear
          const double scale = 1.0 / std::hypot(x * 300.0, v);
          log_size -= std::log(scale);
          for (double* value : {&x, &v, &before, &queue[0], &queue[1], &queue[2]}) *value *= scale;
        }
      }
    };
    run(10'000);
    const double from = log_size;
    run(100'000);
    EXPECT_NEAR((log_size - from) / 1e5, std::log(device::spectral_radius(loop, stiffness)), 2e-5);
  }
}

TEST(LoopPassivity, ClosedForms) {
  const double T = 1e-3;
  for (const double K : {10.0, 1000.0, 40'000.0}) {
    EXPECT_NEAR(device::passive_damping({.period_s = T}, K), 0.5 * K * T, 1e-9 * K * T);
    EXPECT_NEAR(device::passive_damping({.period_s = T, .delay_ticks = 1}, K), 1.5 * K * T, 1e-6 * K * T);
    EXPECT_NEAR(device::passive_damping({.period_s = T, .delay_ticks = 2}, K), 2.5 * K * T, 1e-6 * K * T);
    for (const double B : {0.5, 4.0})
      EXPECT_NEAR(device::passive_damping({.wall_damping_N_s_per_m = B, .period_s = T}, K), 0.5 * K * T + B,
                  1e-9 * (K * T + B));
  }
}

TEST(LoopPassivity, LargestStiffnessIsTheInverse) {
  for (int delay = 0; delay <= 2; ++delay) {
    for (const double B : {0.0, 0.7}) {
      const SampledLoop loop{.damping_N_s_per_m = 3.0, .wall_damping_N_s_per_m = B, .delay_ticks = delay};
      const double k = device::largest_passive_stiffness(loop);
      EXPECT_NEAR(device::passive_damping(loop, k), 3.0, 1e-5);
      if (delay == 0) {
        EXPECT_NEAR(k, 2.0 * (3.0 - B) / 1e-3, 1e-2);
      }
    }
  }
  EXPECT_EQ(device::largest_passive_stiffness({.damping_N_s_per_m = 1.0, .wall_damping_N_s_per_m = 1.5}),
            0.0);
}

// The published formula, evaluated with complex numbers at each angle.
TEST(LoopPassivity, AngleByAngleAsPrinted) {
  const double T = 2e-3, K = 1500.0, B = 1.2;
  for (int delay = 0; delay <= 3; ++delay) {
    for (double theta = 0.01; theta < std::numbers::pi; theta += 0.05) {
      const std::complex<double> back = std::exp(std::complex<double>(0.0, -theta));
      const std::complex<double> wall = (K + B * (1.0 - back) / T) * std::pow(back, delay);
      const double printed = 0.5 * T * ((1.0 - back) * wall).real() / (1.0 - std::cos(theta));
      EXPECT_NEAR(device::passive_damping_at(
                      {.wall_damping_N_s_per_m = B, .period_s = T, .delay_ticks = delay}, K, theta),
                  printed, 1e-8);
    }
  }
}

TEST(FrictionAndQuantisation, AbbottAndOkamura) {
  // With the Premium's friction and encoder step, the bound is 2·0.04 N / 0.03 mm.
  EXPECT_NEAR(device::friction_and_quantisation_bound(5.0, 1e-3, 0.04, 0.03e-3), 2666.7, 0.1);
  EXPECT_EQ(device::friction_and_quantisation_bound(0.5, 1e-3, 0.04, 0.03e-3), 1000.0);
  EXPECT_EQ(device::friction_and_quantisation_bound(0.5, 1e-3, 0.0, 0.03e-3), 0.0);
  EXPECT_EQ(device::friction_and_quantisation_bound(0.5, 1e-3, 0.0, 0.0), 1000.0);
}

}  // namespace
