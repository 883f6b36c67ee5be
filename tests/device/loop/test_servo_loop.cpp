// SPDX-License-Identifier: GPL-3.0-or-later
// The loop on the calling thread, with simulated devices.
#include "device/loop/servo_loop.h"

#include <gtest/gtest.h>

#include <csignal>
#include <stdexcept>
#include <vector>

#include "device/loop/force_gate.h"
#include "device/loop/stop_signal.h"
#include "device/paths/path.h"
#include "device/simulated/simulated.h"

namespace {

using device::ServoAnswer;
using device::ServoInput;

class Recorder final : public device::HapticDevice {
 public:
  device::DeviceState read() noexcept override { return {}; }
  void write(const glm::dvec3& force_N, double /*dt_s*/) noexcept override { given.push_back(force_N.z); }
  [[nodiscard]] device::DeviceLimits limits() const noexcept override { return {}; }
  [[nodiscard]] std::string_view name() const noexcept override { return "recorder"; }
  std::vector<double> given;
};

TEST(ServoLoop, TicksUntilTheFunctionEndsItAndLetsGo) {
  Recorder device;
  int n = 0;
  auto tick = [&n](const ServoInput& input) {
    EXPECT_DOUBLE_EQ(input.dt_s, 1.0 / 4000);
    return ServoAnswer{.force_N = {0, 0, 1.0 + n}, .go_on = ++n < 4};
  };
  const device::ServoReport report = device::run_servo(device, {.rate_hz = 4000}, tick);
  EXPECT_EQ(report.ticks, 4U);
  EXPECT_EQ(report.end, device::ServoEnd::finished);
  EXPECT_EQ(device.given, (std::vector<double>{1, 2, 3, 0}));
}

TEST(ServoLoop, LetsGoWhenTheFunctionThrows) {
  Recorder device;
  int n = 0;
  auto tick = [&n](const ServoInput& /*input*/) -> ServoAnswer {
    if (++n == 3) throw std::runtime_error("of the tick");
    return {.force_N = {0, 0, 1}};
  };
  EXPECT_THROW(device::run_servo(device, {}, tick), std::runtime_error);
  EXPECT_EQ(device.given, (std::vector<double>{1, 1, 0}));
}

TEST(ServoLoop, ASignalEndsAPacedOne) {
  Recorder device;
  int n = 0;
  auto tick = [&n](const ServoInput& /*input*/) {
    if (++n == 3) raise(SIGTERM);
    return ServoAnswer{.force_N = {0, 0, 1}, .go_on = n < 1000};
  };
  const device::ServoReport report = device::run_servo(device, {.realtime = true}, tick);
  EXPECT_EQ(report.end, device::ServoEnd::stopped);
  EXPECT_EQ(report.ticks, 3U);
  EXPECT_EQ(device.given.back(), 0.0);
}

TEST(ServoLoop, ASignalEndsOneThatIsNotPacedWhereItIsTaken) {
  Recorder device;
  int n = 0;
  auto tick = [&n](const ServoInput& /*input*/) {
    if (++n == 3) raise(SIGTERM);
    return ServoAnswer{.force_N = {0, 0, 1}, .go_on = n < 1000};
  };
  const device::StopOnSignal stop;
  const device::ServoReport report = device::run_servo(device, {}, tick);
  EXPECT_EQ(report.end, device::ServoEnd::stopped);
  EXPECT_EQ(report.ticks, 3U);
  EXPECT_EQ(device::stop_signal(), SIGTERM);
}

TEST(StopOnSignal, ObjectsOverlapAndTheLastOneRestoresWhatWasThere) {
  static int taken = 0;
  taken = 0;
  const auto before = std::signal(SIGTERM, [](int) { ++taken; });
  {
    const device::StopOnSignal outer;
    { const device::StopOnSignal inner; }
    EXPECT_NO_THROW(device::stop_if_asked());
    raise(SIGTERM);
    EXPECT_EQ(taken, 0);
    EXPECT_EQ(device::stop_signal(), SIGTERM);
    EXPECT_THROW(device::stop_if_asked(), device::StopAsked);
    raise(SIGTERM);  // the second signal goes to the previous handler
    EXPECT_EQ(taken, 1);
  }
  EXPECT_EQ(device::stop_signal(), 0);
  raise(SIGTERM);
  EXPECT_EQ(taken, 2);
  std::signal(SIGTERM, before);
}

TEST(ForceGate, ClosesAtOnceRestsAndRamps) {
  constexpr double kTick_s = 1e-3;
  device::ForceGate gate({.rest_s = 0.1, .ramp_s = 0.2});
  for (int i = 0; i < 1000; ++i) gate.pass(kTick_s);
  EXPECT_EQ(gate.pass(kTick_s), 1.0);
  gate.close();
  double before = gate.pass(kTick_s);
  EXPECT_EQ(before, 0.0);
  int zero = 1, less = 1;
  for (int i = 0; i < 1000; ++i) {
    const double now = gate.pass(kTick_s);
    EXPECT_GE(now, before);
    EXPECT_LE(now - before, kTick_s / 0.2 * (1 + 1e-12));
    zero += now == 0.0 ? 1 : 0;
    less += now < 1.0 ? 1 : 0;
    before = now;
  }
  EXPECT_NEAR(zero, 100, 3);
  EXPECT_NEAR(less, 300, 3);
  EXPECT_EQ(before, 1.0);
}

TEST(ForceGate, StaysClosedAsLongAsItIsClosed) {
  device::ForceGate gate;
  for (int i = 0; i < 5000; ++i) {
    gate.close();
    ASSERT_EQ(gate.pass(1e-3), 0.0);
  }
}

}  // namespace
