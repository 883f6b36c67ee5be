// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/simulated/tool_mechanics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <random>
#include <utility>

namespace {

using device::ToolIntegrator;
using device::ToolMechanics;
using device::ToolMotion;

constexpr double kTick_s = 1e-3;
const ToolMechanics kHeld{.mass_kg = 0.081, .hand_damping_N_s_per_m = 5.0, .hand_stiffness_N_per_m = 600.0};

void advance(const ToolMechanics& mechanics, ToolMotion& motion, const glm::dvec3& from, const glm::dvec3& to,
             const glm::dvec3& force, double dt_s, double substep_s = device::kToolSubstep_s) {
  ToolIntegrator(mechanics, substep_s).advance(motion, from, to, force, dt_s);
}

void advance_about(const ToolMechanics& mechanics, ToolMotion& motion, const glm::dvec3& target,
                   const glm::dvec3& force, double dt_s) {
  advance(mechanics, motion, target, target, force, dt_s);
}

// x(t) of m·a + d·v + k·x = k·step, from rest at x = 0, for any damping.
double step_response(const ToolMechanics& m, double step, double t) {
  const double w = std::sqrt(m.hand_stiffness_N_per_m / m.mass_kg);
  const double zeta = (m.hand_damping_N_s_per_m + m.viscous_N_s_per_m) / (2.0 * m.mass_kg * w);
  if (zeta < 1.0) {
    const double wd = w * std::sqrt(1.0 - zeta * zeta);
    return step * (1.0 - std::exp(-zeta * w * t) * (std::cos(wd * t) + zeta * w / wd * std::sin(wd * t)));
  }
  const double root = std::sqrt(zeta * zeta - 1.0);
  const double s1 = w * (-zeta + root), s2 = w * (-zeta - root);
  return step * (1.0 - (s2 * std::exp(s1 * t) - s1 * std::exp(s2 * t)) / (s2 - s1));
}

TEST(ToolMechanics, StepResponseIsThatOfMassSpringAndDamper) {
  for (const double damping : {4.0, 5.0, 7.4, 40.0}) {
    ToolMechanics mechanics = kHeld;
    mechanics.hand_damping_N_s_per_m = damping;
    mechanics.viscous_N_s_per_m = 0.005;
    ToolMotion motion;
    double worst_m = 0.0;
    for (int tick = 1; tick <= 500; ++tick) {
      advance_about(mechanics, motion, {0.01, 0, 0}, {0, 0, 0}, kTick_s);
      worst_m =
          std::max(worst_m, std::abs(motion.position_m.x - step_response(mechanics, 0.01, tick * kTick_s)));
    }
    EXPECT_LT(worst_m, 1e-14) << "damping " << damping;  // exact but for rounding
  }
}

TEST(ToolMechanics, AConstantForceStretchesTheHandByItsStiffness) {
  ToolMotion motion;
  for (int tick = 0; tick < 2000; ++tick) advance_about(kHeld, motion, {0, 0, 0}, {3.0, -1.0, 0.5}, kTick_s);
  EXPECT_LE(glm::length(motion.position_m - glm::dvec3(3.0, -1.0, 0.5) / 600.0), 1e-12);
}

TEST(ToolMechanics, AMovingTargetIsFollowedWithoutALagAtConstantSpeed) {
  ToolMotion motion;
  const glm::dvec3 step(1e-4, 0, 0);  // 0.1 m/s
  for (int tick = 0; tick < 2000; ++tick) {
    advance(kHeld, motion, step * double(tick), step * double(tick + 1), {0, 0, 0}, kTick_s);
  }
  EXPECT_NEAR(motion.position_m.x, 0.2, 1e-9);
  EXPECT_NEAR(motion.velocity_m_per_s.x, 0.1, 1e-9);
}

// A brisk hand circles and jumps, while motors push sideways. Returns the largest change of the tool's
// position (m) if the substep is halved.
double changed_by_halving_m(double mass_kg, double coulomb_N, double substep_s) {
  const ToolMechanics mechanics{.mass_kg = mass_kg,
                                .viscous_N_s_per_m = 0.005,
                                .coulomb_N = coulomb_N,
                                .hand_damping_N_s_per_m = 5.0,
                                .hand_stiffness_N_per_m = 600.0};
  ToolIntegrator one(mechanics, substep_s), other(mechanics, 0.5 * substep_s);
  ToolMotion whole, half;
  double worst_m = 0.0;
  const auto target = [](double t) {
    return glm::dvec3(0.02 * std::sin(19.0 * t), 0.01 * std::sin(7.0 * t), t > 0.5 ? 0.01 : 0.0);
  };
  for (int tick = 0; tick < 2000; ++tick) {
    const double t = tick * kTick_s;
    const glm::dvec3 force = tick % 200 < 100 ? glm::dvec3(0, 0, 4.0) : glm::dvec3(0.0);
    one.advance(whole, target(t), target(t + kTick_s), force, kTick_s);
    other.advance(half, target(t), target(t + kTick_s), force, kTick_s);
    worst_m = std::max(worst_m, glm::length(whole.position_m - half.position_m));
  }
  return worst_m;
}

TEST(ToolMechanics, HalvingTheSubstepChangesNothingThatMatters) {
  // For comparison, the encoder steps are 30 µm (for the device with 0.04 N of friction) and 55 µm (0.26 N).
  EXPECT_LT(changed_by_halving_m(0.081, 0.04, device::kToolSubstep_s), 0.005e-6);
  EXPECT_LT(changed_by_halving_m(0.051, 0.26, device::kToolSubstep_s), 0.05e-6);
  for (const auto& [mass_kg, coulomb_N] : {std::pair{0.081, 0.04}, std::pair{0.051, 0.26}}) {
    double before_m = changed_by_halving_m(mass_kg, coulomb_N, 1e-3);
    for (const double substep_s : {5e-4, 2.5e-4, 1.25e-4}) {
      const double changed_m = changed_by_halving_m(mass_kg, coulomb_N, substep_s);
      EXPECT_LT(changed_m, before_m / 3.5)
          << substep_s << " s, " << coulomb_N << " N";  // convergence is of second order
      before_m = changed_m;
    }
  }
}

TEST(ToolMechanics, AlongALineTheSubstepHardlyMatters) {
  // The motion has stops, sticking and reversals. Only the moment of a stop depends on the substep.
  const ToolMechanics mechanics{.mass_kg = 0.051,
                                .viscous_N_s_per_m = 0.005,
                                .coulomb_N = 0.26,
                                .hand_damping_N_s_per_m = 5.0,
                                .hand_stiffness_N_per_m = 600.0};
  ToolIntegrator coarse(mechanics, 1e-3), fine(mechanics, 1e-5);
  const glm::dvec3 line(2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0);
  ToolMotion a, b;
  double worst_m = 0.0;
  for (int tick = 0; tick < 2000; ++tick) {
    const auto target = [&](double t) { return line * (0.01 * std::sin(19.0 * t)); };
    const double t = tick * kTick_s;
    const glm::dvec3 force = tick % 200 < 100 ? 2.0 * line : glm::dvec3(0.0);
    coarse.advance(a, target(t), target(t + kTick_s), force, kTick_s);
    fine.advance(b, target(t), target(t + kTick_s), force, kTick_s);
    worst_m = std::max(worst_m, glm::length(a.position_m - b.position_m));
  }
  EXPECT_LT(worst_m, 1e-7);
}

TEST(ToolMechanics, ATargetThatMovesAwayTakesTheToolAlongWhenItPullsMoreThanFriction) {
  // The target moves at 10 mm/s. After 35 ms, the hand's 5 N·s/m and 600 N/m pull as strongly as the
  // friction, with 0.26 N.
  ToolMechanics mechanics = kHeld;
  mechanics.coulomb_N = 0.26;
  const glm::dvec3 speed(0.006, 0.0, -0.008);
  for (const double dt_s : {1e-4, 1e-3, 7e-3, 0.1}) {  // the moment may lie anywhere in a tick
    ToolIntegrator integrator(mechanics);
    ToolMotion motion;
    double t = 0.0;
    const double gives_way_s = (0.26 - 5.0 * 0.01) / (600.0 * 0.01);
    for (; t + dt_s < gives_way_s; t += dt_s) {
      integrator.advance(motion, t * speed, (t + dt_s) * speed, {0, 0, 0}, dt_s);
      ASSERT_EQ(motion.position_m, glm::dvec3(0.0)) << t;
    }
    for (; t < 0.1 - 1e-9; t += dt_s)
      integrator.advance(motion, t * speed, (t + dt_s) * speed, {0, 0, 0}, dt_s);
    // From then on the system is linear with constant friction. It starts at rest, and the pull beyond 0.26 N
    // drives it.
    const device::LinearFlow flow = device::linear_flow(0.081, 5.0, 600.0, t - gives_way_s);
    const double went_m =
        0.01 * (flow.time_s - flow.from_velocity_s) - flow.from_acceleration_s2 * 5.0 * 0.01 / 0.081;
    EXPECT_LE(glm::length(motion.position_m - went_m * glm::normalize(speed)), 1e-12) << dt_s;
  }
}

TEST(ToolMechanics, CoulombFrictionStopsASlideWhereItsEnergyIsSpent) {
  // Without a hand, the tool moves on a straight line until ½·m·v² = f·distance. After that its position
  // stays the same to the last bit.
  const ToolMechanics loose{.mass_kg = 0.075, .coulomb_N = 0.04};
  ToolMotion motion;
  motion.velocity_m_per_s = {0.06, -0.08, 0.0};
  const glm::dvec3 direction = glm::normalize(motion.velocity_m_per_s);
  const double distance = 0.5 * loose.mass_kg * 0.1 * 0.1 / loose.coulomb_N;
  const double stop_s = loose.mass_kg * 0.1 / loose.coulomb_N;
  double last_speed = 0.1;
  for (int tick = 0; tick * kTick_s < stop_s + 0.01; ++tick) {
    advance_about(loose, motion, {0, 0, 0}, {0, 0, 0}, kTick_s);
    const double along = glm::dot(motion.velocity_m_per_s, direction);
    ASSERT_GE(along, 0.0) << "friction never turns a motion round";
    ASSERT_LE(along, last_speed);
    last_speed = along;
  }
  EXPECT_EQ(motion.velocity_m_per_s, glm::dvec3(0.0));
  EXPECT_LE(glm::length(motion.position_m - direction * distance), 1e-14);
  const glm::dvec3 stopped = motion.position_m;
  for (int tick = 0; tick < 1000; ++tick) advance_about(loose, motion, {0, 0, 0}, {0, 0, 0}, kTick_s);
  EXPECT_EQ(motion.position_m, stopped);
}

TEST(ToolMechanics, BelowTheFrictionNothingCreepsAndAboveItEverythingMoves) {
  ToolMechanics mechanics = kHeld;
  mechanics.coulomb_N = 0.26;
  ToolMotion motion;
  for (int tick = 0; tick < 5000; ++tick) {
    // 0.24 N in total: 0.1 N from the hand and 0.22 N from the motors, at a right angle.
    advance_about(mechanics, motion, {0.1 / 600.0, 0, 0}, {0, 0.22, 0}, kTick_s);
    ASSERT_EQ(motion.position_m, glm::dvec3(0.0));
  }
  advance_about(mechanics, motion, {0.1 / 600.0, 0, 0}, {0, 0.25, 0}, kTick_s);
  EXPECT_GT(glm::length(motion.position_m), 0.0);
}

TEST(ToolMechanics, NoEnergyComesFromNothing) {
  // With the target at rest and no motor force, the sum of kinetic and spring energy never rises, for soft
  // and for stiff springs.
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (const double stiffness : {0.0, 1.0, 600.0, 25e3, 1e7}) {
    for (const double damping : {0.0, 5.0, 1e4}) {
      for (const double friction : {0.0, 0.26}) {
        for (const double dt_s : {1e-4, 1e-3, 1e-2, 0.1, 10.0}) {
          const ToolMechanics mechanics{.mass_kg = 0.051,
                                        .coulomb_N = friction,
                                        .hand_damping_N_s_per_m = damping,
                                        .hand_stiffness_N_per_m = stiffness};
          ToolMotion motion;
          motion.position_m = 0.1 * glm::dvec3(unit(random), unit(random), unit(random));
          motion.velocity_m_per_s = glm::dvec3(unit(random), unit(random), unit(random));
          const auto energy = [&] {
            return 0.5 * mechanics.mass_kg * glm::dot(motion.velocity_m_per_s, motion.velocity_m_per_s) +
                   0.5 * stiffness * glm::dot(motion.position_m, motion.position_m);
          };
          double last = energy();
          for (int tick = 0; tick < 30; ++tick) {
            advance_about(mechanics, motion, {0, 0, 0}, {0, 0, 0}, dt_s);
            ASSERT_LE(energy(), last * (1.0 + 1e-12))
                << stiffness << ' ' << damping << ' ' << friction << ' ' << dt_s;
            last = energy();
          }
        }
      }
    }
  }
}

TEST(ToolMechanics, AnUndampedTurnLosesNothing) {
  const ToolMechanics spring{.mass_kg = 0.081, .hand_stiffness_N_per_m = 600.0};
  ToolMotion motion;
  motion.position_m.x = 0.01;
  for (int tick = 0; tick < 100'000; ++tick) advance_about(spring, motion, {0, 0, 0}, {0, 0, 0}, kTick_s);
  const double energy = 0.5 * spring.mass_kg * glm::dot(motion.velocity_m_per_s, motion.velocity_m_per_s) +
                        0.5 * 600.0 * glm::dot(motion.position_m, motion.position_m);
  EXPECT_NEAR(energy / (0.5 * 600.0 * 1e-4), 1.0, 1e-10);  // allows for the rounding of 10^5 ticks
}

TEST(ToolMechanics, NoTimeMovesNothingAndTooMuchDoesNotHang) {
  ToolMotion motion;
  for (const double dt_s : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
    advance_about(kHeld, motion, {1, 1, 1}, {1, 1, 1}, dt_s);
    EXPECT_EQ(motion.position_m, glm::dvec3(0.0));
  }
  advance_about(kHeld, motion, {1, 1, 1}, {0, 0, 0}, 1e12);
  EXPECT_LE(glm::length(motion.position_m - glm::dvec3(1.0)), 1e-9);
}

}  // namespace
