// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/simulated/simulated.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <vector>

namespace {

using device::device_limits;
using device::DeviceModel;
using device::DeviceState;
using device::HandModel;
using device::LissajousPath;
using device::make_path;
using device::make_simulated_device;
using device::Path;
using device::WaypointPath;

constexpr double kTick_s = 1e-3;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

std::shared_ptr<const Path> stay_at(const glm::dvec3& place) {
  return make_path(WaypointPath{.points = {{place, 0.0}}});
}

std::shared_ptr<const Path> leg(const glm::dvec3& from, const glm::dvec3& to, double speed) {
  return make_path(WaypointPath{.points = {{from, 0.0}, {to, 0.0}}, .speed_m_per_s = speed});
}

// The simplest environment: a one-sided wall at z = 0.
glm::dvec3 wall(const DeviceState& state, double stiffness) {
  return {0.0, 0.0, state.position_m.z < 0.0 ? -stiffness * state.position_m.z : 0.0};
}

TEST(SimulatedDevice, FiguresAreThoseOfTheMakers) {
  const auto premium = device_limits(DeviceModel::premium_1_5);
  EXPECT_EQ(premium.max_force_N, 8.5);
  EXPECT_EQ(premium.max_stiffness_N_per_m, 3500.0);
  EXPECT_EQ(premium.resolution_m, 0.03e-3);
  EXPECT_EQ(premium.friction_N, 0.04);
  const auto touch = device_limits(DeviceModel::touch);
  EXPECT_EQ(touch.max_force_N, 3.3);
  EXPECT_EQ(touch.resolution_m, 0.055e-3);
  EXPECT_EQ(touch.friction_N, 0.26);
  EXPECT_EQ(device_limits(DeviceModel::ideal).resolution_m, 0.0);
  EXPECT_EQ(device_limits(DeviceModel::ideal).friction_N, 0.0);
}

TEST(SimulatedDevice, StartsAtRestWhereThePathStarts) {
  const glm::dvec3 start(0.01, -0.02, 0.03);
  for (const DeviceModel model : {DeviceModel::premium_1_5, DeviceModel::touch}) {
    const auto device = make_simulated_device(model, {}, leg(start, {0, 0, 0}, 0.1));
    const DeviceState state = device->read();
    EXPECT_LE(glm::length(state.position_m - start), device->limits().resolution_m);
    EXPECT_EQ(state.velocity_m_per_s, glm::dvec3(0.0));
    EXPECT_EQ(state.buttons, 0U);
  }
}

TEST(SimulatedDevice, EncodersTellWholeSteps) {
  const LissajousPath curve{.amplitude_m = {0.02, 0.03, 0.01}, .frequency_hz = {1.0, 0.7, 2.0}};
  for (const DeviceModel model : {DeviceModel::premium_1_5, DeviceModel::touch}) {
    const auto device = make_simulated_device(model, {}, make_path(curve));
    for (int tick = 0; tick < 500; ++tick) {
      device->write({0, 0, 0}, kTick_s);
      const glm::dvec3 steps = device->read().position_m / device->limits().resolution_m;
      for (int axis = 0; axis < 3; ++axis) ASSERT_NEAR(steps[axis], std::round(steps[axis]), 1e-9);
    }
  }
}

TEST(SimulatedDevice, TheHandGivesWayByForceOverStiffnessAndMotorsSaturate) {
  const HandModel hand{.mass_kg = 0.006, .damping_N_s_per_m = 5.0, .stiffness_N_per_m = 600.0};
  for (const DeviceModel model : {DeviceModel::premium_1_5, DeviceModel::touch}) {
    const device::DeviceLimits limits = device_limits(model);
    // Friction holds the tool anywhere within friction / stiffness of its target.
    const double tolerance = limits.friction_N / hand.stiffness_N_per_m + limits.resolution_m;
    for (const double force_N : {1.0, 3.0, 100.0, 1e6}) {
      const auto device = make_simulated_device(model, hand, stay_at({0, 0, 0}));
      for (int tick = 0; tick < 2000; ++tick) device->write({0.0, 0.6 * force_N, -0.8 * force_N}, kTick_s);
      const double played_N = std::min(force_N, limits.max_force_N);
      const glm::dvec3 expected = glm::dvec3(0.0, 0.6, -0.8) * (played_N / hand.stiffness_N_per_m);
      EXPECT_LE(glm::length(device->read().position_m - expected), tolerance) << force_N << " N";
    }
  }
}

TEST(SimulatedDevice, AForceThatIsNoNumberIsNotPlayed) {
  const auto a = make_simulated_device(DeviceModel::premium_1_5, {}, stay_at({0, 0, 0}));
  for (const glm::dvec3& bad :
       {glm::dvec3(kNaN, 0, 0), glm::dvec3(0, HUGE_VAL, 0), glm::dvec3(0, 0, -HUGE_VAL)}) {
    for (int tick = 0; tick < 100; ++tick) a->write(bad, kTick_s);
    EXPECT_EQ(a->read().position_m, glm::dvec3(0.0));
  }
  a->write({1, 0, 0}, kNaN);
  a->write({1, 0, 0}, -1.0);
  EXPECT_EQ(a->read().position_m, glm::dvec3(0.0));
}

TEST(SimulatedDevice, TheVelocityEstimateIsTheMeanOfTheLastMillisecondsWithinAnEncoderStep) {
  const auto device = make_simulated_device(DeviceModel::premium_1_5, {}, leg({0, 0, 0}, {0.2, 0, 0}, 0.1));
  for (int tick = 0; tick < 1000; ++tick) device->write({0, 0, 0}, kTick_s);
  for (int tick = 0; tick < 500; ++tick) {
    device->write({0, 0, 0}, kTick_s);
    // 0.03 mm in 8 ms is the velocity resolution of the encoder.
    ASSERT_NEAR(device->read().velocity_m_per_s.x, 0.1, 0.03e-3 / 8e-3 + 1e-6);
  }
  for (int tick = 0; tick < 3000; ++tick) device->write({0, 0, 0}, kTick_s);  // to the end of the path
  EXPECT_EQ(device->read().velocity_m_per_s, glm::dvec3(0.0)) << "at rest there is no speed left over";
}

TEST(SimulatedDevice, TheVelocityEstimateHoldsAtAnyRateAndAfterStalls) {
  for (const double dt_s : {1e-5, 1e-4, 1e-3, 1e-2, 0.1}) {
    const auto device = make_simulated_device(DeviceModel::premium_1_5, {}, leg({0, 0, 0}, {1.0, 0, 0}, 0.1));
    const long ticks = std::lround(2.0 / dt_s);
    for (long tick = 0; tick < ticks; ++tick) device->write({0, 0, 0}, dt_s);
    EXPECT_NEAR(device->read().velocity_m_per_s.x, 0.1, 0.03e-3 / 5e-3) << dt_s;
  }
}

TEST(SimulatedDevice, ASoftWallIsHeldAndAFarTooStiffOneBuzzes) {
  // In the closed loop, the hand presses 10 mm into walls. Their stiffness is below or above the largest that
  // a sampled loop can render.
  const auto unrest_m = [](double stiffness) {
    const auto device =
        make_simulated_device(DeviceModel::premium_1_5, {}, leg({0, 0, 0.01}, {0, 0, -0.01}, 0.05));
    double low = 1.0, high = -1.0;
    for (int tick = 0; tick < 3000; ++tick) {
      device->write(wall(device->read(), stiffness), kTick_s);
      const double z = device->read().position_m.z;
      if (tick < 2000) continue;
      low = std::min(low, z);
      high = std::max(high, z);
    }
    return high - low;
  };
  EXPECT_LE(unrest_m(1000.0), 0.03e-3);
  EXPECT_GT(unrest_m(100e3), 10 * 0.03e-3);
}

TEST(SimulatedDevice, TheSameInputsGiveTheSameBits) {
  const auto trace = [] {
    const auto device = make_simulated_device(
        DeviceModel::touch, {},
        make_path(LissajousPath{.amplitude_m = {0.02, 0.03, 0.01}, .frequency_hz = {1, 2, 3}}));
    std::vector<glm::dvec3> positions;
    for (int tick = 0; tick < 2000; ++tick) {
      device->write(wall(device->read(), 2000.0), kTick_s);
      positions.push_back(device->read().position_m);
      positions.push_back(device->read().velocity_m_per_s);
    }
    return positions;
  };
  EXPECT_EQ(trace(), trace());
}

TEST(IdealDevice, IsWhereThePathIsWhateverTheForce) {
  const LissajousPath curve{
      .amplitude_m = {0.02, 0.03, 0.01}, .frequency_hz = {1.0, 2.0, 3.0}, .duration_s = 5.0};
  const std::shared_ptr<const Path> path = make_path(curve);
  const auto device = make_simulated_device(DeviceModel::ideal, {}, path);
  EXPECT_EQ(device->read().position_m, path->position(0.0));
  for (int tick = 0; tick < 3000; ++tick) {
    device->write(tick % 2 == 0 ? glm::dvec3(1e9, kNaN, -1e9) : glm::dvec3(0.0), kTick_s);
    const double t = (tick + 1) * kTick_s;
    const DeviceState state = device->read();
    ASSERT_EQ(state.position_m, path->position(t));
    for (int i = 0; i < 3; ++i) {
      const double w = 2.0 * std::numbers::pi * curve.frequency_hz[i];
      ASSERT_NEAR(state.velocity_m_per_s[i], curve.amplitude_m[i] * w * std::cos(w * t), 1e-6);
    }
  }
}

TEST(SimulatedDevice, AHandThatCannotBeIsRefused) {
  EXPECT_THROW(make_simulated_device(DeviceModel::ideal, {}, nullptr), std::invalid_argument);
  for (const HandModel& bad : {HandModel{.mass_kg = -1.0}, HandModel{.damping_N_s_per_m = kNaN},
                               HandModel{.stiffness_N_per_m = HUGE_VAL}}) {
    EXPECT_THROW(make_simulated_device(DeviceModel::touch, bad, stay_at({0, 0, 0})), std::invalid_argument);
  }
}

}  // namespace
