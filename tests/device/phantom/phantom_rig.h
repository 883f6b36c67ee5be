// SPDX-License-Identifier: GPL-3.0-or-later
// A PHANToM that runs on the test double of its driver's library.
#pragma once

#include <dlfcn.h>

#include <cmath>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>

#include "device/phantom/phantom.h"
#include "tests/device/phantom/fake_libhd/fake_libhd.h"

namespace tests {

class PhantomRig {
 public:
  PhantomRig() : library_(dlopen(FAKE_LIBHD, RTLD_NOW | RTLD_LOCAL)) {
    if (library_ == nullptr) throw std::runtime_error(dlerror());
    find<void()>("fake_hd_reset")();
    hd = find<FakeHd*()>("fake_hd")();
  }

  [[nodiscard]] device::PhantomOptions options() const {
    device::PhantomOptions options;
    options.open.library = FAKE_LIBHD;
    options.open.pause_s = 0.0;
    options.silence_s = 2.0;
    options.clock_ns = find<std::int64_t() noexcept>("fake_hd_now_ns");
    return options;
  }

  // Opens the device, serves `ticks` ticks with a constant 2 N upwards in the scene (device y), and closes
  // it.
  device::ServoReport serve(std::uint64_t ticks) const { return serve(ticks, options()); }
  device::ServoReport serve(std::uint64_t ticks, const device::PhantomOptions& with) const {
    const auto phantom = device::open_phantom(with);
    std::uint64_t n = 0;
    auto push = [&n, ticks](const device::ServoInput& /*input*/) {
      return device::ServoAnswer{.force_N = {0, 0, kForce_N}, .go_on = ++n < ticks};
    };
    return device::run_servo(*phantom, {}, push);
  }

  // Magnitude of the i-th force that was sent (N).
  [[nodiscard]] double given_N(std::size_t i) const {
    const auto& f = hd->forces.at(i).newton;
    return std::hypot(f[0], f[1], f[2]);
  }
  // Magnitude of the force in the last frame of a tick (N); -1 if there is none.
  [[nodiscard]] double at_tick_N(std::uint64_t tick) const {
    double found = -1.0;
    for (std::size_t i = 0; i < hd->forces.size(); ++i) {
      if (hd->forces[i].tick == tick) found = given_N(i);
    }
    return found;
  }

  static constexpr double kForce_N = 2.0;
  FakeHd* hd = nullptr;

 private:
  template <typename Function>
  Function* find(const char* name) const {
    return reinterpret_cast<Function*>(dlsym(library_, name));
  }
  void* library_;
};

inline std::string all(const std::vector<std::string>& messages) {
  std::string text;
  for (const std::string& one : messages) text += one + "\n";
  return text;
}

// The error text that `call` throws; empty if it throws nothing.
template <typename Call>
std::string refusal(const Call& call) {
  try {
    call();
  } catch (const device::DeviceError& e) {
    return e.what();
  }
  return "";
}

}  // namespace tests
