// SPDX-License-Identifier: GPL-3.0-or-later
// Faults of a PHANToM, one by one. Each leads to zero force within one tick, and to a message with a remedy.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>

#include "tests/device/phantom/phantom_rig.h"

namespace {

using testing::HasSubstr;
using tests::PhantomRig;

constexpr std::uint64_t kAt =
    2000;  // tick of the fault; long after the ramp, so that the full force acts before it

// ---- faults before any force is sent
struct OpeningFault {
  std::string name;
  std::function<void(FakeHd&)> happen;
  std::string what, remedy;
};
std::ostream& operator<<(std::ostream& out, const OpeningFault& fault) {
  return out << fault.name;
}

class PhantomOpening : public testing::TestWithParam<OpeningFault> {};

TEST_P(PhantomOpening, IsRefusedWithItsRemedyAndClosedAgain) {
  const PhantomRig rig;
  GetParam().happen(*rig.hd);
  const std::string words = tests::refusal([&] { (void)rig.serve(100); });
  EXPECT_THAT(words, HasSubstr(GetParam().what));
  EXPECT_THAT(words, HasSubstr(GetParam().remedy));
  EXPECT_TRUE(rig.hd->forces.empty());
  EXPECT_EQ(rig.hd->open_devices, 0);
  EXPECT_FALSE(rig.hd->scheduler_runs);
}

INSTANTIATE_TEST_SUITE_P(
    All, PhantomOpening,
    testing::Values(OpeningFault{"NoDevice", [](FakeHd& hd) { hd.failing_inits = -1; },
                                 "HD_COMM_ERROR (0x302", "switch the device on and plug it in"},
                    OpeningFault{"StaleConfiguration",
                                 [](FakeHd& hd) {
                                   hd.failing_inits = -1;
                                   hd.init_error = 0x303;
                                 },
                                 "HD_COMM_CONFIG_ERROR", "GTDD_HOME"},
                    OpeningFault{"InvalidLicence",
                                 [](FakeHd& hd) {
                                   hd.failing_inits = -1;
                                   hd.init_error = 0x600;
                                 },
                                 "HD_INVALID_LICENSE", "install its licence file"},
                    OpeningFault{
                        "HeldByAnotherProgram",
                        [](FakeHd& hd) { hd.open_devices = 0, hd.init_error = 0x301, hd.failing_inits = -1; },
                        "HD_DEVICE_ALREADY_INITIATED", "close the program that holds it"},
                    OpeningFault{"NoTimer", [](FakeHd& hd) { hd.start_error = 0x304; },
                                 "servo loop does not start: HD_TIMER_ERROR", "close other programs"},
                    OpeningFault{"SchedulerFull", [](FakeHd& hd) { hd.schedule_error = 0x501; },
                                 "HD_SCHEDULER_FULL", "close other programs that hold the device"},
                    OpeningFault{"NotCalibratedInkwell", [](FakeHd& hd) { hd.calibration = 0x5002; },
                                 "is not calibrated", "inkwell"},
                    OpeningFault{"NotCalibratedEncoderReset",
                                 [](FakeHd& hd) {
                                   hd.calibration = 0x5002;
                                   hd.calibration_style = 1;
                                 },
                                 "is not calibrated", "devices --calibrate"}),
    [](const auto& fault) { return fault.param.name; });

TEST(PhantomOpens, OneFailureIsTriedAgain) {
  for (const int failures : {1, 2, 3, 5}) {
    const PhantomRig rig;
    rig.hd->failing_inits = failures;
    EXPECT_EQ(rig.serve(1000).ticks, 1000U) << failures;
  }
  const PhantomRig rig;  // a named device is opened only by this name
  rig.hd->failing_inits = 1;
  device::PhantomOptions options = rig.options();
  options.open.name = "left";
  EXPECT_EQ(rig.serve(10, options).ticks, 10U);
  rig.hd->failing_inits = 2;
  EXPECT_THAT(tests::refusal([&] { (void)rig.serve(10, options); }), HasSubstr("\"left\": HD_COMM_ERROR"));
}

TEST(PhantomOpens, ACalibrationThatNeedsNoHandIsDone) {
  const PhantomRig rig;
  rig.hd->calibration = 0x5001;
  rig.hd->calibration_style = 6;  // inkwell or automatic
  EXPECT_EQ(rig.serve(100).ticks, 100U);
  EXPECT_EQ(rig.hd->updates, std::vector<unsigned>{2});
}

TEST(PhantomOpens, AnEncoderResetIsDoneWhenTheHandHoldsTheArm) {
  const PhantomRig rig;
  rig.hd->calibration = 0x5002;
  rig.hd->calibration_style = 1;
  const auto phantom = device::open_phantom(rig.options());
  EXPECT_FALSE(phantom->info().calibrated);
  EXPECT_TRUE(rig.hd->updates.empty()) << "not before it is asked for";
  EXPECT_TRUE(phantom->calibrate());
  EXPECT_EQ(rig.hd->updates, std::vector<unsigned>{1});
}

// ---- faults while forces are sent
struct RunningFault {
  std::string name;
  std::function<void(FakeHd&)> happen;
  bool ends = false;          // true: the session ends; false: the force returns
  std::uint64_t zero_by = 0;  // ticks after the fault by which the force must be zero
  std::string what, remedy;
};
std::ostream& operator<<(std::ostream& out, const RunningFault& fault) {
  return out << fault.name;
}

class PhantomRunning : public testing::TestWithParam<RunningFault> {};

TEST_P(PhantomRunning, LetsGoWithinOneTick) {
  const RunningFault& fault = GetParam();
  const PhantomRig rig;
  fault.happen(*rig.hd);
  const device::ServoReport report = rig.serve(5000);
  const std::string words = tests::all(report.messages);
  EXPECT_THAT(words, HasSubstr(fault.what));
  EXPECT_THAT(words, HasSubstr(fault.remedy));
  EXPECT_EQ(rig.hd->open_devices, 0);
  EXPECT_EQ(rig.hd->misuse, 0U);

  ASSERT_EQ(rig.at_tick_N(kAt - 1), PhantomRig::kForce_N) << "or the test shows nothing";
  const std::uint64_t zero_at = kAt + fault.zero_by;
  EXPECT_EQ(rig.at_tick_N(zero_at), 0.0);
  EXPECT_EQ(rig.given_N(rig.hd->forces.size() - 1), 0.0);
  if (fault.ends) {
    EXPECT_EQ(report.end, device::ServoEnd::lost);
    EXPECT_EQ(rig.hd->forces.back().tick, zero_at) << "nothing is given after it";
    EXPECT_THAT(words, HasSubstr("what was felt until then is kept"));
    return;
  }
  EXPECT_EQ(report.end, device::ServoEnd::finished);
  EXPECT_EQ(report.ticks, 5000U);
  EXPECT_EQ(rig.at_tick_N(4998), PhantomRig::kForce_N) << "it comes back";
  for (std::uint64_t tick = zero_at; tick < 4998; ++tick) {
    const double now = rig.given_N(tick), next = rig.given_N(tick + 1);
    ASSERT_LE(next - now, PhantomRig::kForce_N / 500 * (1 + 1e-9)) << "by the ramp, at tick " << tick;
  }
}

std::function<void(FakeHd&)> error(unsigned code, std::uint64_t ticks = 1, bool after = false) {
  return [=](FakeHd& hd) {
    hd.error = code;
    hd.error_at = kAt;
    hd.error_ticks = ticks;
    hd.error_after_force = after;
  };
}

INSTANTIATE_TEST_SUITE_P(
    All, PhantomRunning,
    testing::Values(
        RunningFault{"Unplugged", error(0x302, FakeHd::never), true, 0, "HD_COMM_ERROR", "check the cable"},
        RunningFault{"UnpluggedAtTheFramesEnd", error(0x302, FakeHd::never, true), true, 0, "HD_COMM_ERROR",
                     "check the cable"},
        RunningFault{"DeviceFault", error(0x300), true, 0, "HD_DEVICE_FAULT", "switch it off and on"},
        RunningFault{"HandleGone", error(0x104), true, 0, "HD_BAD_HANDLE", "plug it in and start again"},
        RunningFault{"FrameError", error(0x402, 1, true), true, 0, "HD_FRAME_ERROR", "check the cable"},
        RunningFault{"UnknownError", error(0x7777), true, 0, "0x7777", "diagnostic program"},
        RunningFault{"CalibrationLost", [](FakeHd& hd) { hd.calibration_lost_at = kAt; }, true, 0,
                     "lost its calibration", "hybrid devices"},
        RunningFault{"WarmMotors", error(0x200, 300), false, 0, "HD_WARM_MOTORS", "until they cool"},
        RunningFault{"WarmMotorsAtTheFramesEnd", error(0x200, 300, true), false, 1, "(300 times)",
                     "until they cool"},
        RunningFault{"ForceTooLarge", error(0x201), false, 0, "HD_EXCEEDED_MAX_FORCE ",
                     "lower [tool] stiffness"},
        RunningFault{"ForceTooSudden", error(0x202, 1, true), false, 1, "HD_EXCEEDED_MAX_FORCE_IMPULSE",
                     "max_slew"},
        RunningFault{"TooFast", error(0x203), false, 0, "HD_EXCEEDED_MAX_VELOCITY", "move more slowly"},
        RunningFault{"ForceError", error(0x204), false, 0, "HD_FORCE_ERROR", "safety switch"},
        RunningFault{"SafetySwitch",
                     [](FakeHd& hd) {
                       hd.has_safety_switch = true;
                       hd.switch_opens_at = kAt;
                       hd.switch_closes_at = kAt + 400;
                     },
                     false, 0, "not held in 400 ticks", "hold it while you touch"},
        RunningFault{"LateTick",
                     [](FakeHd& hd) {
                       hd.late_at = kAt;
                       hd.late_s = 0.037;
                     },
                     false, 0, "the longest 37 ms", "real-time priority"},
        RunningFault{"NoNumber", [](FakeHd& hd) { hd.nan_at = kAt; }, false, 0,
                     "1 positions were not numbers", "check the cable"}),
    [](const auto& fault) { return fault.param.name; });

// A session that continues after a fault sees only valid positions.
TEST(PhantomRuns, APositionThatIsNoNumberIsNotSeen) {
  const PhantomRig rig;
  rig.hd->nan_at = 5;
  const auto phantom = device::open_phantom(rig.options());
  int n = 0;
  bool finite = true;
  auto tick = [&](const device::ServoInput& input) {
    finite =
        finite && std::isfinite(input.device.position_m.z) && std::isfinite(input.device.velocity_m_per_s.z);
    return device::ServoAnswer{.force_N = glm::dvec3(0.0), .go_on = ++n < 10};
  };
  device::run_servo(*phantom, {}, tick);
  EXPECT_TRUE(finite);
}

TEST(PhantomRuns, AFaultIsToldToTheTickWhileItLasts) {
  const PhantomRig rig;
  rig.hd->error = 0x200;
  rig.hd->error_at = 1000;
  rig.hd->error_ticks = 10;
  const auto phantom = device::open_phantom(rig.options());
  std::vector<device::DeviceFault> seen;
  auto tick = [&](const device::ServoInput& input) {
    seen.push_back(input.device.fault);
    return device::ServoAnswer{.force_N = {1, 0, 0}, .go_on = seen.size() < 3000};
  };
  device::run_servo(*phantom, {}, tick);
  EXPECT_EQ(seen[999], device::DeviceFault::none);
  for (int i = 1000; i < 1010; ++i)
    EXPECT_EQ(seen[static_cast<std::size_t>(i)], device::DeviceFault::warm_motors);
  EXPECT_EQ(seen.back(), device::DeviceFault::none);
}

// If the driver's thread has died, it no longer replaces its last force. So the session sends zero from its
// own thread.
TEST(PhantomRuns, ASilentDriverEndsTheSession) {
  const PhantomRig rig;
  rig.hd->silent_at = kAt;
  device::PhantomOptions options = rig.options();
  options.silence_s = 0.3;
  const device::ServoReport report = rig.serve(5000, options);
  EXPECT_EQ(report.end, device::ServoEnd::lost);
  EXPECT_EQ(report.ticks, kAt);
  EXPECT_THAT(tests::all(report.messages), HasSubstr("fell silent"));
  EXPECT_THAT(tests::all(report.messages), HasSubstr("switch the device off and on"));
  EXPECT_EQ(rig.given_N(rig.hd->forces.size() - 1), 0.0);
}

TEST(PhantomRuns, HotMotorsAreWorthAWord) {
  const PhantomRig rig;
  rig.hd->temperature = 0.9;
  EXPECT_THAT(tests::all(rig.serve(500).messages), HasSubstr("90 % of the temperature they bear"));
}

}  // namespace
