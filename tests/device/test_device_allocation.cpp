// SPDX-License-Identifier: GPL-3.0-or-later
// Nothing that runs on the servo thread allocates. This program counts every call of operator new.
#include <gtest/gtest.h>

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>

#include "device/force_limit.h"
#include "device/passivity.h"
#include "device/servo_timer.h"
#include "device/simulated.h"

namespace {
std::atomic<std::size_t> allocations{0};
}  // namespace

// Not inlined: where the compiler sees free() meet new it takes them for a mismatch.
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
        device->hold(1e-4);
        (void)device->limits();
        (void)device->name();
        if (tick % 100 == 0) timer.wait();
      }
      EXPECT_EQ(allocations, before);
    }
  }
}

}  // namespace
