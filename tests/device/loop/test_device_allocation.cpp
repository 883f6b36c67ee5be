// SPDX-License-Identifier: GPL-3.0-or-later
// Nothing on the servo thread allocates. This program counts every call of operator new.
#include <gtest/gtest.h>

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>

#include "device/loop/force_limit.h"
#include "device/loop/passivity.h"
#include "device/loop/servo_timer.h"
#include "device/phantom/phantom_servo.h"
#include "device/simulated/simulated.h"

namespace {
std::atomic<std::size_t> allocations{0};
}  // namespace

// The operators are not inlined, because the compiler would warn that free() does not match new.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t /*size*/) noexcept {
  std::free(memory);
}

namespace {

using device::DeviceModel;

TEST(DeviceAllocation, TheCounterCounts) {
  const std::size_t before = allocations;
  const auto something = std::make_unique<int>(1);
  EXPECT_EQ(allocations, before + 1) << *something;
}

TEST(DeviceAllocation, ATickOfEveryDeviceAllocatesNothing) {
  const device::PathDescription paths[] = {
      device::PressPath{.to_m = {0, 0, -0.01}, .repeat = 5},
      device::SlidePath{.to_m = {0.05, 0, 0}, .lift_m = {0, 0, 0.01}},
      device::LissajousPath{.amplitude_m = {0.01, 0.01, 0.01}, .frequency_hz = {1, 2, 3}},
  };
  for (const device::PathDescription& description : paths) {
    for (const DeviceModel model : {DeviceModel::ideal, DeviceModel::premium_1_5, DeviceModel::touch}) {
      const auto device = make_simulated_device(model, {}, device::make_path(description));
      device::ServoTimer timer(1e-5);
      device::ForceLimitState state;
      device::PassivityState passive;
      const std::size_t before = allocations;
      for (int tick = 0; tick < 1000; ++tick) {
        const device::DeviceState read = device->read();
        const glm::dvec3 force = limit_force({}, state, -500.0 * read.position_m, read, 1e-3);
        device->write(keep_passive({}, passive, force, read.position_m, 1e-3), 1e-3);
        device->delay(1e-4);
        (void)device->limits();
        (void)device->name();
        if (tick % 100 == 0) timer.wait();
      }
      EXPECT_EQ(allocations, before);
    }
  }
}

// A driver whose functions do nothing, for tests of the callback.
device::HdFunctions idle_driver() {
  device::HdFunctions call;
  call.begin_frame = [](unsigned) {};
  call.end_frame = [](unsigned) {};
  call.get_error = [] { return device::hd::ErrorInfo{}; };
  call.get_booleans = [](unsigned, unsigned char* value) { *value = 1; };
  call.get_integers = [](unsigned, int* value) { *value = 0; };
  call.get_doubles = [](unsigned, double* value) { value[0] = value[1] = value[2] = 0.5; };
  call.set_doubles = [](unsigned, const double*) {};
  call.check_calibration = [] { return device::hd::kCalibrated; };
  call.update_calibration = [](unsigned) {};
  return call;
}

TEST(DeviceAllocation, ATickOfTheRealDevicesCallbackAllocatesNothing) {
  int n = 0;
  auto tick = [&n](const device::ServoInput& input) {
    return device::ServoAnswer{.force_N = -500.0 * input.device.position_m, .go_on = ++n < 3000};
  };
  device::PhantomServo servo(idle_driver(), 1,
                             {.gate = {},
                              .clock_ns = []() noexcept { return std::int64_t{1}; },
                              .fit = {},
                              .has_safety_switch = true},
                             tick);
  const std::size_t before = allocations;
  for (int i = 0; i < 4000 && !servo.done(); ++i) {
    if (i == 1000) servo.report_error({device::hd::kWarmMotors, 0, 1});
    if (i == 2000) servo.report_error({device::hd::kExceededForce, 0, 1});
    device::PhantomServo::on_tick(&servo);
  }
  EXPECT_EQ(allocations, before);
  EXPECT_TRUE(servo.done());
  EXPECT_EQ(servo.report().messages.size(), 2U);
}

}  // namespace
