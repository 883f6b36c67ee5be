// SPDX-License-Identifier: GPL-3.0-or-later
// One loop for all devices: a simulated one is ticked by the calling thread, as fast as it goes or paced by a
// timer; a real one by its driver's servo thread.
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
  double dt_s = 1e-3;   // of the rate, not of the clock: a session can be played again
  double late_s = 0.0;  // how late this tick came; 0 where nothing paces it
};

struct ServoAnswer {
  glm::dvec3 force_N{0.0};  // on the hand, scene frame
  bool go_on = true;        // false: this was the last tick, and its force is not given
  bool skip = false;  // no tick, as in a pause: a simulated device stands still, a real one gets no force
};

// A reference to what computes a tick; it must outlive the loop. Costs no allocation.
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
  finished,  // the function said so
  stopped,   // a signal did
  lost,      // the device is gone or refuses to go on
};

struct ServoReport {
  ServoEnd end = ServoEnd::finished;
  std::uint64_t ticks = 0;
  std::uint64_t late_ticks = 0;       // by more than half a period (driver), or periods left out (timer)
  std::string priority;               // what the thread was granted, in words; empty where nothing paces it
  std::vector<std::string> messages;  // what happened, and what to do about it; empty when nothing did
};

struct ServoOptions {
  double rate_hz = 1000.0;
  bool realtime = false;  // pace a simulated device with a timer, and stop on a signal
  // From one tick to the next; a later one is told as DeviceFault::late, which is recorded, as it is felt.
  double deadline_s = 10e-3;
};

// A device whose driver has the servo thread.
class ServoDriver {
 public:
  ServoDriver() = default;
  ServoDriver(const ServoDriver&) = delete;
  ServoDriver& operator=(const ServoDriver&) = delete;
  ServoDriver(ServoDriver&&) = delete;
  ServoDriver& operator=(ServoDriver&&) = delete;
  virtual ~ServoDriver() = default;
  // Calls `tick` from the driver's thread until it ends, is stopped or the device is lost; the motors are let
  // go before it returns. An exception of `tick` lets go of them too, and comes out here.
  virtual ServoReport serve(ServoFunction tick, const ServoOptions& options) = 0;
};

// Reads, ticks and writes until the function ends it, or a signal does. The last force written is zero, also
// when the function throws.
ServoReport run_servo(HapticDevice& device, const ServoOptions& options, ServoFunction tick);

}  // namespace device
