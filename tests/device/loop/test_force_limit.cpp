// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/loop/force_limit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <random>
#include <utility>
#include <vector>

namespace {

using device::ForceLimits;
using device::ForceLimitState;
using device::limit_force;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr ForceLimits kNoFadeNoSlew{.max_force_N = 8.5, .max_slew_N_per_s = kInfinity, .soft_start_s = 0.0};

bool finite(const glm::dvec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

// A random command. Its components cover all magnitudes of a double, NaN and infinities.
glm::dvec3 wild_command(std::mt19937_64& random) {
  std::uniform_real_distribution<double> exponent(-320.0, 308.0), sign(-1.0, 1.0);
  std::uniform_int_distribution<int> kind(0, 39);
  const auto component = [&] {
    switch (kind(random)) {
      case 0:
        return kNaN;
      case 1:
        return kInfinity;
      case 2:
        return -kInfinity;
      case 3:
        return 0.0;
      case 4:
        return std::numeric_limits<double>::max();
      default:
        break;
    }
    return std::copysign(std::pow(10.0, kind(random) < 20 ? exponent(random) : sign(random)), sign(random));
  };
  return {component(), component(), component()};
}

TEST(ForceLimit, NothingButFiniteForcesWithinTheLimitComeOut) {
  std::mt19937_64 random(1);
  for (const double max_force_N : {8.5, 3.3, 1e-3, 0.1 + 0.2}) {
    for (const double slew : {50e3, 1e3, kInfinity}) {
      const ForceLimits limits{.max_force_N = max_force_N, .max_slew_N_per_s = slew, .soft_start_s = 0.01};
      ForceLimitState state;
      for (int i = 0; i < 20'000; ++i) {
        const glm::dvec3 force = limit_force(limits, state, wild_command(random), 1e-3);
        ASSERT_TRUE(finite(force));
        ASSERT_TRUE(finite(state.last_N));
        ASSERT_LE(glm::length(force), max_force_N);
      }
      EXPECT_GT(state.nonfinite, 0U);
    }
  }
}

TEST(ForceLimit, AnInfiniteLimitStillLetsOutNothingNonFinite) {
  std::mt19937_64 random(2);
  const ForceLimits limits{.max_force_N = kInfinity, .max_slew_N_per_s = kInfinity, .soft_start_s = 0.0};
  ForceLimitState state;
  for (int i = 0; i < 20'000; ++i) {
    ASSERT_TRUE(finite(limit_force(limits, state, wild_command(random), 1e-3)));
  }
}

TEST(ForceLimit, AStepIsNeverLargerThanTheSlew) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> newton(-20.0, 20.0), dt(0.0, 2e-3);
  const ForceLimits limits{.max_force_N = 8.5, .max_slew_N_per_s = 2e3, .soft_start_s = 0.05};
  ForceLimitState state;
  glm::dvec3 last(0.0);
  for (int i = 0; i < 20'000; ++i) {
    const double dt_s = dt(random);
    const glm::dvec3 force =
        limit_force(limits, state, {newton(random), newton(random), newton(random)}, dt_s);
    ASSERT_LE(glm::length(force - last), limits.max_slew_N_per_s * dt_s + 1e-12);
    last = force;
  }
  EXPECT_GT(state.slewed, 0U);
  EXPECT_GT(state.clamped, 0U);
}

TEST(ForceLimit, WhatIsWithinEveryLimitPassesUnchanged) {
  ForceLimitState state;
  const ForceLimits limits{.max_force_N = 8.5, .max_slew_N_per_s = 50e3, .soft_start_s = 0.0};
  const glm::dvec3 command(0.1, -0.2, 0.3);
  EXPECT_EQ(limit_force(limits, state, command, 1e-3), command);
  EXPECT_EQ(limit_force(limits, state, -command, 1e-3), -command);
  EXPECT_EQ(state.clamped + state.slewed + state.nonfinite, 0U);
}

TEST(ForceLimit, ClampingKeepsTheDirection) {
  ForceLimitState state;
  const glm::dvec3 command(30.0, -40.0, 120.0);
  const glm::dvec3 force = limit_force(kNoFadeNoSlew, state, command, 1e-3);
  EXPECT_NEAR(glm::length(force), 8.5, 1e-12);
  EXPECT_NEAR(glm::dot(glm::normalize(force), glm::normalize(command)), 1.0, 1e-15);
  EXPECT_EQ(state.clamped, 1U);
}

TEST(ForceLimit, ANonFiniteCommandGivesZeroAndLeavesNoTrace) {
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    for (int axis = 0; axis < 3; ++axis) {
      ForceLimitState state;
      const glm::dvec3 good(1.0, 2.0, 3.0);
      limit_force(kNoFadeNoSlew, state, good, 1e-3);
      glm::dvec3 command = good;
      command[axis] = bad;
      EXPECT_EQ(limit_force(kNoFadeNoSlew, state, command, 1e-3), glm::dvec3(0.0));
      EXPECT_EQ(state.nonfinite, 1U);
      EXPECT_EQ(limit_force(kNoFadeNoSlew, state, good, 1e-3), good);
    }
  }
}

TEST(ForceLimit, ForcesFadeInAfterTheStart) {
  ForceLimitState state;
  const ForceLimits limits{.max_force_N = 8.5, .max_slew_N_per_s = kInfinity, .soft_start_s = 0.05};
  for (int tick = 0; tick < 100; ++tick) {
    const double share = std::min(1.0, tick / 50.0);
    EXPECT_NEAR(limit_force(limits, state, {4.0, 0.0, 0.0}, 1e-3).x, 4.0 * share, 1e-12) << tick;
  }
}

TEST(ForceLimit, LimitsThatMakeNoSenseLetNothingThrough) {
  for (const double bad : {kNaN, -1.0, 0.0, -kInfinity}) {
    ForceLimitState state;
    EXPECT_EQ(limit_force({.max_force_N = bad, .soft_start_s = 0.0}, state, {1.0, 1.0, 1.0}, 1e-3),
              glm::dvec3(0.0));
    state = {};
    const ForceLimits limits{.max_slew_N_per_s = bad, .soft_start_s = 0.0};
    EXPECT_EQ(limit_force(limits, state, {1.0, 1.0, 1.0}, 1e-3), glm::dvec3(0.0));
  }
  // No time passes, so the force must not change.
  for (const double bad_dt_s : {kNaN, -1.0, kInfinity}) {
    ForceLimitState state;
    EXPECT_EQ(limit_force({.soft_start_s = 0.0}, state, {1.0, 1.0, 1.0}, bad_dt_s), glm::dvec3(0.0));
    EXPECT_EQ(state.elapsed_s, 0.0);
  }
}

TEST(ForceLimit, AMissedDeadlineLetsGoAndFadesInAnew) {
  ForceLimitState state;
  const ForceLimits limits{
      .max_force_N = 8.5, .max_slew_N_per_s = kInfinity, .soft_start_s = 0.05, .deadline_s = 5e-3};
  const glm::dvec3 command(2.0, 0.0, 0.0);
  for (int tick = 0; tick < 100; ++tick) limit_force(limits, state, command, 1e-3);
  EXPECT_EQ(limit_force(limits, state, command, 5e-3), command) << "in time to the last";
  EXPECT_EQ(limit_force(limits, state, command, 5.1e-3), glm::dvec3(0.0));
  EXPECT_EQ(state.late, 1U);
  for (int tick = 0; tick < 100; ++tick) {
    EXPECT_NEAR(limit_force(limits, state, command, 1e-3).x, 2.0 * std::min(1.0, tick / 50.0), 1e-12);
  }
  EXPECT_EQ(limit_force(limits, state, command, {.fault = device::DeviceFault::late}, 1e-3), glm::dvec3(0.0));
  EXPECT_EQ(state.late, 2U);
  EXPECT_EQ(limit_force({.deadline_s = kNaN}, state, command, 1e-3), glm::dvec3(0.0));
}

TEST(ForceLimit, AFaultOfTheDeviceLetsGoForAsLongAsItLasts) {
  using device::DeviceFault;
  for (const DeviceFault fault : {DeviceFault::lost, DeviceFault::not_calibrated, DeviceFault::warm_motors,
                                  DeviceFault::force_limit, DeviceFault::velocity_limit}) {
    ForceLimitState state;
    const ForceLimits limits{.soft_start_s = 0.05};
    const glm::dvec3 command(0.0, 1.0, 0.0);
    for (int tick = 0; tick < 100; ++tick) limit_force(limits, state, command, {}, 1e-3);
    for (int tick = 0; tick < 10; ++tick)
      ASSERT_EQ(limit_force(limits, state, command, {.fault = fault}, 1e-3), glm::dvec3(0.0));
    EXPECT_EQ(state.lost, 10U);
    EXPECT_EQ(limit_force(limits, state, command, {}, 1e-3), glm::dvec3(0.0)) << "and begins softly";
    EXPECT_NEAR(limit_force(limits, state, command, {}, 1e-3).y, 1.0 / 50.0, 1e-12);
  }
}

// A constant force accelerates the tool without end.
TEST(ForceLimit, NoMoreEnergyThanTheLimitIsHandedOutInAnyWindow) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> unit(-1.0, 1.0), dt(1e-4, 3e-3);
  for (const double most_J : {0.01, 0.5}) {
    const ForceLimits limits{
        .max_slew_N_per_s = kInfinity, .soft_start_s = 0.0, .max_energy_J = most_J, .energy_window_s = 0.05};
    ForceLimitState state;
    glm::dvec3 position(0.0), force(0.0);
    std::vector<std::pair<double, double>> handed;  // time (s), energy (J)
    double now_s = 0.0, most_window_J = 0.0, most_tick_J = 0.0;
    for (int tick = 0; tick < 5000; ++tick) {
      const double dt_s = dt(random);
      now_s += dt_s;
      const glm::dvec3 way = dt_s * glm::dvec3(2.0 + unit(random), unit(random), 0.0);
      position += way;
      const double work = std::max(0.0, glm::dot(force, way));
      handed.emplace_back(now_s, work);
      most_tick_J = std::max(most_tick_J, work);
      double window_J = 0.0;
      for (auto i = handed.rbegin(); i != handed.rend() && i->first > now_s - 0.05; ++i)
        window_J += i->second;
      most_window_J = std::max(most_window_J, window_J);
      force = limit_force(limits, state, {5.0, 0.0, 0.0}, {.position_m = position}, dt_s);
    }
    EXPECT_LE(most_window_J, most_J + most_tick_J);
    EXPECT_GT(most_window_J, 0.5 * most_J);
    EXPECT_GT(state.energy_limited, 0U);
  }
}

TEST(ForceLimit, EnergyThatTheHandGivesIsNotLimited) {
  ForceLimitState state;
  const ForceLimits limits{.soft_start_s = 0.0, .max_energy_J = 0.01};
  for (int tick = 0; tick < 1000; ++tick) {  // 8 N against a motion at 2 m/s: 16 J/s
    const device::DeviceState tool{.position_m = {2e-3 * tick, 0, 0}};
    ASSERT_EQ(limit_force(limits, state, {-8.0, 0, 0}, tool, 1e-3).x, -8.0);
  }
  EXPECT_EQ(state.energy_limited, 0U);
}

}  // namespace
