// SPDX-License-Identifier: GPL-3.0-or-later
// Effects of the simulated device on the haptic loop: stability boundary, delay, watchdog, slew rate, tremor.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <stdexcept>

#include "device/loop/linear_flow.h"
#include "device/simulated/simulated.h"

namespace {

using device::make_simulated_device;
using device::SimulatedDeviceOptions;

constexpr double kTick_s = 1e-3;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::shared_ptr<const device::Path> stay_at(const glm::dvec3& place) {
  return device::make_path(device::WaypointPath{.points = {{place, 0.0}}});
}

SimulatedDeviceOptions linear(double mass_kg = 0.075) {
  SimulatedDeviceOptions options;
  options.mechanism = {
      .name = "linear", .limits = {kInfinity, kInfinity, 0.0, 0.0}, .apparent_mass_kg = mass_kg};
  return options;
}

// Growth of an oscillation over `ticks`, after one impulse against a two-sided spring of `stiffness`. It is
// the swing about the mean at the end, divided by the swing at the start.
double growth(const SimulatedDeviceOptions& options, double stiffness, double dt_s, int ticks) {
  const auto device = make_simulated_device(options, stay_at({0, 0, 0}));
  double early = 0.0, late = 0.0;
  for (int tick = 0; tick < ticks; ++tick) {
    glm::dvec3 force = -stiffness * device->read().position_m;
    if (tick == 0) force.x = 1.0;
    device->write(force, dt_s);
    const double swing = std::abs(device->read().position_m.x);
    if (tick < ticks / 10) early = std::max(early, swing);
    if (tick >= ticks - ticks / 10) late = std::max(late, swing);
  }
  return late / early;
}

// The stiffness (N/m) above which the determinant of the sampled loop's 2×2 matrix exceeds 1 (Jury's
// criterion). It is the stability limit if the mass oscillates between samples.
double unstable_above(const SimulatedDeviceOptions& options, double dt_s) {
  const double mass = options.mechanism.apparent_mass_kg + options.hand.mass_kg;
  const double damping = options.hand.damping_N_s_per_m + options.mechanism.viscous_N_s_per_m;
  const device::LinearFlow f = device::linear_flow(mass, damping, options.hand.stiffness_N_per_m, dt_s);
  return (1.0 - f.velocity_factor) * mass /
             (f.from_velocity_s * f.from_velocity_s - f.from_acceleration_s2 * f.velocity_factor) -
         options.hand.stiffness_N_per_m;
}

TEST(SimulatedLoop, AWallIsStableUpToTheEigenvaluesToATenthOfAPercent) {
  for (const device::Grip grip : {device::Grip::loose, device::Grip::medium, device::Grip::firm}) {
    for (const double dt_s : {2.5e-4, 1e-3, 2e-3}) {
      SimulatedDeviceOptions options = linear();
      options.hand = device::hand_of(grip);
      const double boundary = unstable_above(options, dt_s);
      EXPECT_LT(growth(options, 0.999 * boundary, dt_s, 60'000), 1.0) << boundary;
      EXPECT_GT(growth(options, 1.001 * boundary, dt_s, 60'000), 1.0) << boundary;
    }
  }
}

TEST(SimulatedLoop, DelayIsWholeTicks) {
  for (const int ticks : {0, 1, 2, 7, device::kMaxDelayTicks}) {
    SimulatedDeviceOptions options = linear();
    options.delay_ticks = ticks;
    const auto delayed = make_simulated_device(options, stay_at({0, 0, 0}));
    options.delay_ticks = 0;
    const auto prompt = make_simulated_device(options, stay_at({0, 0, 0}));
    for (int tick = 0; tick < ticks; ++tick) {
      delayed->write({std::sin(0.3 * tick), 0, 1}, kTick_s);
      ASSERT_EQ(delayed->read().position_m, glm::dvec3(0.0)) << "nothing is played before its time";
    }
    for (int tick = 0; tick < 100; ++tick) {
      prompt->write({std::sin(0.3 * tick), 0, 1}, kTick_s);
      delayed->write({std::sin(0.3 * (tick + ticks)), 0, 1}, kTick_s);
      ASSERT_EQ(prompt->read().position_m, delayed->read().position_m) << tick;
    }
  }
}

TEST(SimulatedLoop, DelayMakesTheWallUnstableEarlier) {
  double before = kInfinity;
  for (const int ticks : {0, 1, 2}) {
    SimulatedDeviceOptions options = linear();
    options.delay_ticks = ticks;
    double low = 1.0, high = 1e6;
    for (int i = 0; i < 30; ++i) {
      const double middle = std::sqrt(low * high);
      (growth(options, middle, kTick_s, 4000) > 1.0 ? high : low) = middle;
    }
    EXPECT_LT(low, 0.7 * before) << ticks;
    before = low;
  }
}

TEST(SimulatedLoop, TheWatchdogLetsGoOfTheMotors) {
  // During a stall of 50 ms the watchdog lets the force act for the first 5 ms only. This equals a commanded
  // force of 5 ms followed by zero force.
  SimulatedDeviceOptions options;
  options.watchdog_s = 5e-3;
  const auto watched = make_simulated_device(options, stay_at({0, 0, 0}));
  watched->write({0, 0, 4}, 50e-3);
  options.watchdog_s.reset();
  const auto commanded = make_simulated_device(options, stay_at({0, 0, 0}));
  commanded->write({0, 0, 4}, 5e-3);
  commanded->write({0, 0, 0}, 45e-3);
  EXPECT_EQ(watched->read().position_m, commanded->read().position_m);
  // A late tick has the same effect as a long tick. The next write restarts the watchdog.
  options.watchdog_s = 5e-3;
  const auto late = make_simulated_device(options, stay_at({0, 0, 0}));
  late->write({0, 0, 4}, 1e-3);
  late->delay(49e-3);
  EXPECT_LE(glm::length(late->read().position_m - commanded->read().position_m), 0.03e-3);
  const double before = late->read().position_m.z;
  late->write({0, 0, 4}, 5e-3);
  EXPECT_GT(late->read().position_m.z, before + 0.1e-3);
  late->delay(-1.0);
  late->delay(std::nan(""));
  // Without a watchdog the force stays.
  options.watchdog_s.reset();
  const auto pushed = make_simulated_device(options, stay_at({0, 0, 0}));
  pushed->write({0, 0, 4}, 0.5);
  EXPECT_NEAR(pushed->read().position_m.z, 4.0 / 600.0, 0.1e-3);
}

TEST(SimulatedLoop, AmplifiersAreAsFastAsTheySay) {
  SimulatedDeviceOptions options = linear();
  options.mechanism.motor_slew_N_per_s = 1000.0;
  const auto slow = make_simulated_device(options, stay_at({0, 0, 0}));
  options.mechanism.motor_slew_N_per_s = kInfinity;
  const auto fast = make_simulated_device(options, stay_at({0, 0, 0}));
  for (int tick = 1; tick <= 20; ++tick) {
    slow->write({0, 8, 0}, kTick_s);
    fast->write({0, std::min(8.0, static_cast<double>(tick)), 0}, kTick_s);
    ASSERT_LE(glm::length(slow->read().position_m - fast->read().position_m), 1e-15);
  }
}

TEST(SimulatedLoop, TremorShakesTheToolAsItsHandAllows) {
  // Transfer function from target to tool at 10 Hz: (k + iωd)/(k − mω² + iωd), close to 1.
  SimulatedDeviceOptions options = linear();
  options.tremor = {.amplitude_m = 1e-4, .frequency_hz = 10.0};
  const auto device = make_simulated_device(options, stay_at({0.1, 0.2, 0.3}));
  double least = 1.0, most = 0.0;
  for (int tick = 0; tick < 4000; ++tick) {
    device->write({0, 0, 0}, kTick_s);
    if (tick < 2000) continue;
    const double radius = glm::length(device->read().position_m - glm::dvec3(0.1, 0.2, 0.3));
    least = std::min(least, radius);
    most = std::max(most, radius);
  }
  const double w = 2.0 * M_PI * 10.0, m = 0.081;
  const double gain = std::hypot(600.0, w * 5.0) / std::hypot(600.0 - m * w * w, w * 5.0);
  // The target moves on a straight line within a tick. This shortens the radius by the fraction (ωT)²/12.
  EXPECT_NEAR(least, gain * 1e-4, 1e-3 * gain * 1e-4);
  EXPECT_NEAR(most, gain * 1e-4, 1e-3 * gain * 1e-4);
}

TEST(SimulatedLoop, OptionsThatMakeNoSenseAreRefused) {
  const auto refused = [](auto change) {
    SimulatedDeviceOptions options;
    change(options);
    EXPECT_THROW((void)make_simulated_device(options, stay_at({0, 0, 0})), std::invalid_argument);
  };
  refused([](auto& o) { o.delay_ticks = -1; });
  refused([](auto& o) { o.delay_ticks = device::kMaxDelayTicks + 1; });
  refused([](auto& o) { o.watchdog_s = std::nan(""); });
  refused([](auto& o) { o.tremor.amplitude_m = -1.0; });
  refused([](auto& o) { o.tremor.frequency_hz = kInfinity; });
  refused([](auto& o) { o.velocity_span_s = -1.0; });
  refused([](auto& o) { o.mechanism.limits.friction_N = kInfinity; });
  refused([](auto& o) { o.mechanism.limits.max_force_N = -1.0; });
  refused([](auto& o) { o.mechanism.viscous_N_s_per_m = std::nan(""); });
  refused([](auto& o) { o.mechanism.apparent_mass_kg = o.hand.mass_kg = 0.0; });
  EXPECT_THROW((void)make_simulated_device(SimulatedDeviceOptions{}, nullptr), std::invalid_argument);
}

TEST(SimulatedLoop, GripsSpanThePublishedFingers) {
  const device::HandModel loose = device::hand_of(device::Grip::loose),
                          firm = device::hand_of(device::Grip::firm);
  EXPECT_EQ(loose.mass_kg, 3.5e-3);
  EXPECT_EQ(loose.damping_N_s_per_m, 4.0);
  EXPECT_EQ(loose.stiffness_N_per_m, 255.0);
  EXPECT_EQ(firm.mass_kg, 8.7e-3);
  EXPECT_EQ(firm.damping_N_s_per_m, 7.4);
  EXPECT_EQ(firm.stiffness_N_per_m, 1255.0);
}

}  // namespace
