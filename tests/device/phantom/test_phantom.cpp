// SPDX-License-Identifier: GPL-3.0-or-later
// A PHANToM on the test double of its library, in normal operation.
#include "device/phantom/phantom.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "tests/device/phantom/phantom_rig.h"

namespace {

using device::ServoAnswer;
using device::ServoInput;
using tests::PhantomRig;

TEST(Phantom, SaysWhatItIs) {
  const PhantomRig rig;
  const auto phantom = device::open_phantom(rig.options());
  const device::PhantomInfo& info = phantom->info();
  EXPECT_EQ(info.model, "Touch");
  EXPECT_EQ(info.serial, "0042");
  EXPECT_EQ(info.driver_version, "double 1.0");
  EXPECT_EQ(info.firmware, 192.0);
  EXPECT_TRUE(info.calibrated);
  EXPECT_DOUBLE_EQ(info.workspace.high_m.x, 0.08);  // the driver reports millimeters
  EXPECT_TRUE(info.notes.empty());
  EXPECT_EQ(phantom->limits().max_force_N, 3.3);
  EXPECT_DOUBLE_EQ(phantom->limits().workspace_m.y, 0.12);
  EXPECT_EQ(phantom->name(), "Touch (serial 0042)");
}

TEST(Phantom, IsClosedWithItsSchedulerStopped) {
  const PhantomRig rig;
  {
    const auto phantom = device::open_phantom(rig.options());
    EXPECT_EQ(rig.hd->open_devices, 1);
    EXPECT_TRUE(rig.hd->scheduler_runs);
  }
  EXPECT_EQ(rig.hd->open_devices, 0);
  EXPECT_FALSE(rig.hd->scheduler_runs);
}

TEST(Phantom, PositionsComeInMetersInTheSceneAndForcesGoBack) {
  const PhantomRig rig;
  rig.hd->x_mm = 10;
  rig.hd->y_mm = 20;
  rig.hd->z_mm = 30;
  rig.hd->swing_mm = 0;
  {
    const auto phantom = device::open_phantom(rig.options());
    device::WorkspaceFit fit;
    fit.scene_centre_m = {1, 2, 3};
    phantom->place(fit);
    const device::DeviceState before = phantom->read();
    EXPECT_DOUBLE_EQ(before.position_m.x, 1.010);
    EXPECT_DOUBLE_EQ(before.position_m.y, 1.970);
    EXPECT_DOUBLE_EQ(before.position_m.z, 3.020);
    EXPECT_EQ(before.buttons, 1U);
    int n = 0;
    device::DeviceState seen;
    auto tick = [&](const ServoInput& input) {
      seen = input.device;
      return ServoAnswer{.force_N = {0.1, 0.2, 0.3}, .go_on = ++n < 2000};
    };
    device::run_servo(*phantom, {}, tick);
    EXPECT_EQ(seen.position_m, before.position_m);
    EXPECT_EQ(seen.fault, device::DeviceFault::none);
  }
  const auto& given = rig.hd->forces.at(1998).newton;
  EXPECT_DOUBLE_EQ(given[0], 0.1);
  EXPECT_DOUBLE_EQ(given[1], 0.3);   // up
  EXPECT_DOUBLE_EQ(given[2], -0.2);  // towards the user
}

TEST(Phantom, ForcesRiseByTheRampAndTheLastOneIsZero) {
  const PhantomRig rig;
  const device::ServoReport report = rig.serve(1500);
  EXPECT_EQ(report.end, device::ServoEnd::finished);
  EXPECT_EQ(report.ticks, 1500U);
  EXPECT_TRUE(report.messages.empty()) << tests::all(report.messages);
  ASSERT_EQ(rig.hd->forces.size(), 1500U);
  EXPECT_EQ(rig.given_N(0), 0.0);
  double most = 0.0;
  for (std::size_t i = 1; i < 1499; ++i) most = std::max(most, rig.given_N(i) - rig.given_N(i - 1));
  EXPECT_LE(most, 2.0 / 500 * (1 + 1e-9));
  EXPECT_DOUBLE_EQ(rig.given_N(1498), 2.0);
  EXPECT_EQ(rig.given_N(1499), 0.0);
  EXPECT_EQ(rig.hd->misuse, 0U);
}

TEST(Phantom, NeverGivesMoreThanTheDeviceBearsNorWhatIsNoNumber) {
  const PhantomRig rig;
  {
    const auto phantom = device::open_phantom(rig.options());
    int n = 0;
    auto tick = [&n](const ServoInput& /*input*/) {
      ++n;
      ServoAnswer answer{.force_N = {100, 200, -300}, .go_on = n < 3000};
      if (n == 1001) answer.force_N.y = std::numeric_limits<double>::quiet_NaN();
      if (n == 2001) answer.force_N.x = std::numeric_limits<double>::infinity();
      return answer;
    };
    device::run_servo(*phantom, {}, tick);
  }
  for (std::size_t i = 0; i < rig.hd->forces.size(); ++i) ASSERT_LE(rig.given_N(i), 3.3 * (1 + 1e-12)) << i;
  EXPECT_NEAR(rig.given_N(999), 3.3, 1e-9);
  EXPECT_EQ(rig.given_N(1000), 0.0);
  EXPECT_EQ(rig.given_N(1001), 0.0);
  EXPECT_EQ(rig.given_N(2000), 0.0);
}

TEST(Phantom, TheRateIsTheDrivers) {
  const PhantomRig rig;
  device::PhantomOptions options = rig.options();
  options.open.rate_hz = 2000;
  EXPECT_EQ(device::open_phantom(options)->info().rate_hz, 2000.0);
  rig.hd->accepts_rate = false;
  rig.hd->rate_hz = 500;
  const auto phantom = device::open_phantom(options);
  EXPECT_EQ(phantom->info().rate_hz, 500.0);
  ASSERT_EQ(phantom->info().notes.size(), 1U);
  EXPECT_THAT(phantom->info().notes.front(), testing::HasSubstr("500 Hz and not at 2000 Hz"));
  int n = 0;
  double dt_s = 0.0;
  auto tick = [&](const ServoInput& input) {
    dt_s = input.dt_s;
    return ServoAnswer{.force_N = glm::dvec3(0.0), .go_on = ++n < 3};
  };
  device::run_servo(*phantom, {}, tick);
  EXPECT_DOUBLE_EQ(dt_s, 1.0 / 500);
}

TEST(Phantom, CanBeServedAgain) {
  const PhantomRig rig;
  const auto phantom = device::open_phantom(rig.options());
  for (int again = 0; again < 3; ++again) {
    int n = 0;
    auto tick = [&n](const ServoInput& /*input*/) {
      return ServoAnswer{.force_N = {1, 0, 0}, .go_on = ++n < 1000};
    };
    EXPECT_EQ(device::run_servo(*phantom, {}, tick).ticks, 1000U);
  }
}

TEST(Phantom, AnExceptionOfTheTickLetsGoAndComesOut) {
  const PhantomRig rig;
  {
    const auto phantom = device::open_phantom(rig.options());
    int n = 0;
    auto tick = [&n](const ServoInput& /*input*/) -> ServoAnswer {
      if (++n == 1000) throw std::logic_error("of the tick");
      return {.force_N = {1, 0, 0}};
    };
    EXPECT_THROW(device::run_servo(*phantom, {}, tick), std::logic_error);
  }
  EXPECT_GT(rig.given_N(998), 0.9);
  EXPECT_EQ(rig.given_N(999), 0.0);
  EXPECT_EQ(rig.hd->forces.size(), 1000U);
}

TEST(Phantom, AMillionTicksWithoutAFault) {
  constexpr std::uint64_t kTicks = 1'000'000;
  const PhantomRig rig;
  device::ServoReport report;
  double worst_m = 0.0;
  {
    const auto phantom = device::open_phantom(rig.options());
    std::uint64_t n = 0;
    auto wall = [&](const ServoInput& input) {
      // The closed form of the double's hand: a vertical motion of 20 mm at 1 Hz.
      const double expected_m = 0.02 * std::sin(2.0 * std::numbers::pi * 1e-3 * static_cast<double>(n));
      worst_m = std::max(worst_m, std::abs(input.device.position_m.z - expected_m));
      const double z = input.device.position_m.z;
      return ServoAnswer{.force_N = {0, 0, z < 0 ? -100.0 * z : 0.0}, .go_on = ++n < kTicks};
    };
    // The clock starts with the first tick.
    report = device::run_servo(*phantom, {}, wall);
  }
  EXPECT_EQ(report.end, device::ServoEnd::finished);
  EXPECT_EQ(report.ticks, kTicks);
  EXPECT_EQ(report.late_ticks, 0U);
  EXPECT_TRUE(report.messages.empty()) << tests::all(report.messages);
  EXPECT_LT(worst_m, 1e-9);
  ASSERT_EQ(rig.hd->forces.size(), kTicks);
  EXPECT_EQ(rig.hd->misuse, 0U);
  std::uint64_t wrong = 0;
  for (std::uint64_t i = 1000; i + 1 < kTicks; ++i) {
    const double z = 0.02 * std::sin(2.0 * std::numbers::pi * 1e-3 * static_cast<double>(i));
    if (std::abs(rig.given_N(i) - (z < 0 ? -100.0 * z : 0.0)) > 1e-6) ++wrong;
  }
  EXPECT_EQ(wrong, 0U);
}

}  // namespace
