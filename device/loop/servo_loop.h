// SPDX-License-Identifier: GPL-3.0-or-later
// One servo loop for all devices. The ticks of a simulated device run on the calling thread, at full speed or
// paced by a timer. Those of a real device run on its driver's servo thread.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "device/loop/haptic_device.h"

namespace device {

struct ServoInput {
  DeviceState device;
  double dt_s = 1e-3;   // the nominal period, so that a session can be replayed; not the measured time
  double late_s = 0.0;  // delay of this tick's start; 0 for a simulated device that is not paced
};

struct ServoAnswer {
  glm::dvec3 force_N{0.0};  // on the hand, scene frame
  bool go_on = true;        // false: this was the last tick, and its force is not sent
  // True: nothing was computed, as in a pause. A simulated device stands still, a real one gets zero force.
  bool skip = false;
};

// Non-owning reference to the function that computes a tick. The function must outlive the loop. Allocates
// nothing.
class ServoFunction {
 public:
  template <typename Callable>
  requires(!std::is_same_v<std::remove_cvref_t<Callable>, ServoFunction>)
      ServoFunction(Callable& callable)  // NOLINT(google-explicit-constructor): reads as the callable itself
      : callable_(std::addressof(callable)),
        call_([](void* c, const ServoInput& input) { return (*static_cast<Callable*>(c))(input); }) {}
  ServoAnswer operator()(const ServoInput& input) const { return call_(callable_, input); }

 private:
  void* callable_;
  ServoAnswer (*call_)(void*, const ServoInput&);
};

enum class ServoEnd : std::uint8_t {
  finished,  // the function ended it
  stopped,   // a signal ended it
  lost,      // the device is gone or failed
};

struct ServoReport {
  ServoEnd end = ServoEnd::finished;
  std::uint64_t ticks = 0;
  // Real device: ticks that were late by more than half a period. Simulated: periods that the timer skipped.
  std::uint64_t late_ticks = 0;
  // The scheduling that the thread got, in words; empty for a simulated device that is not paced.
  std::string priority;
  std::vector<std::string> messages;  // events, each with a remedy
};

struct ServoOptions {
  double rate_hz = 1000.0;
  bool realtime = false;  // paces a simulated device with a timer, and handles signals (StopOnSignal)
  // Longest time between ticks. A later tick gets DeviceFault::late, which is recorded and sets the force to
  // 0.
  double deadline_s = 10e-3;
};

// A device whose driver owns the servo thread.
class ServoDriver {
 public:
  ServoDriver() = default;
  ServoDriver(const ServoDriver&) = delete;
  ServoDriver& operator=(const ServoDriver&) = delete;
  ServoDriver(ServoDriver&&) = delete;
  ServoDriver& operator=(ServoDriver&&) = delete;
  virtual ~ServoDriver() = default;
  // Calls `tick` on the driver's thread until `tick` ends the loop, a signal comes or the device is lost. The
  // motors are off before serve() returns. An exception of `tick` also turns them off, and is rethrown here.
  virtual ServoReport serve(ServoFunction tick, const ServoOptions& options) = 0;
};

// Serves the device until `tick` or a signal ends the loop: reads, calls `tick`, writes. The last force that
// is written is zero, also if `tick` throws.
ServoReport run_servo(HapticDevice& device, const ServoOptions& options, ServoFunction tick);

}  // namespace device
