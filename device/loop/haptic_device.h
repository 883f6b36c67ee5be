// SPDX-License-Identifier: GPL-3.0-or-later
// The small interface every device is served through, real, simulated or replayed.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <limits>
#include <string_view>

namespace device {

// What a device says of itself at a read. The first that holds, in this order, is the one that is told.
enum class DeviceFault : std::uint8_t {
  none,
  lost,            // it does not answer any more: unplugged, switched off, a communication error
  not_calibrated,  // its positions mean nothing yet
  warm_motors,     // its driver has cut the motors, or is about to, until they are cooler
  force_limit,     // its driver refused a force as too large
  velocity_limit,  // its driver cut the motors because the tool moves too fast
  late,            // the loop's own fault: the force before this read stayed for longer than is allowed
};

// Whether no force may be played while the fault lasts; after it the force fades in anew (force_limit.h).
[[nodiscard]] constexpr bool stops_force(DeviceFault fault) noexcept {
  return fault != DeviceFault::none;
}

struct DeviceState {
  glm::dvec3 position_m{0.0};        // tool centre, scene frame, as the encoders tell it
  glm::dvec3 velocity_m_per_s{0.0};  // the driver's own estimate
  std::uint32_t buttons = 0;         // bit mask
  DeviceFault fault = DeviceFault::none;
};

struct DeviceLimits {
  double max_force_N = 0.0;
  double max_stiffness_N_per_m = 0.0;  // nominal
  double resolution_m = 0.0;           // encoder step; 0 for an ideal device
  double friction_N = 0.0;             // Coulomb, of the mechanism
  // Edges of the box the tool can be moved in, x right, y up, z towards the person. A fact to fit scenes by;
  // a simulated device does not end there.
  glm::dvec3 workspace_m{std::numeric_limits<double>::infinity()};
};

// One servo tick is: read() → compute → write(force). None of the two allocates, locks, throws or does I/O.
class HapticDevice {
 public:
  HapticDevice() = default;
  HapticDevice(const HapticDevice&) = delete;
  HapticDevice& operator=(const HapticDevice&) = delete;
  HapticDevice(HapticDevice&&) = delete;
  HapticDevice& operator=(HapticDevice&&) = delete;
  virtual ~HapticDevice() = default;

  [[nodiscard]] virtual DeviceState read() noexcept = 0;
  // The force on the hand (N, scene frame), held until the next write. A simulated device also advances by
  // dt_s.
  virtual void write(const glm::dvec3& force_N, double dt_s) noexcept = 0;
  // The next tick came late: the force of the last write stayed for another extra_s. A simulated device
  // advances by it, its watchdog counting on from that write; a real one has done so by itself.
  virtual void hold(double /*extra_s*/) noexcept {}
  [[nodiscard]] virtual DeviceLimits limits() const noexcept = 0;
  [[nodiscard]] virtual std::string_view name() const noexcept = 0;
};

}  // namespace device
