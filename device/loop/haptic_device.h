// SPDX-License-Identifier: GPL-3.0-or-later
// The interface to a haptic device: real, simulated or replayed.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <limits>
#include <memory>
#include <string_view>

namespace device {

// Fault of the device at a read. Of several faults, the first in this order is reported.
enum class DeviceFault : std::uint8_t {
  none,
  lost,            // no answer: unplugged, switched off, communication error
  not_calibrated,  // positions are not valid yet
  warm_motors,     // too warm: the driver has switched the motors off, or will do so
  force_limit,     // the driver refused a force as too large
  velocity_limit,  // the driver switched the motors off because the tool moves too fast
  late,            // set by the loop: the last force was held longer than allowed
};

// Whether the force must be zero while the fault lasts. Afterwards the force fades in anew (force_limit.h).
[[nodiscard]] constexpr bool stops_force(DeviceFault fault) noexcept {
  return fault != DeviceFault::none;
}

struct DeviceState {
  glm::dvec3 position_m{0.0};        // tool centre, scene frame, as the encoders report it
  glm::dvec3 velocity_m_per_s{0.0};  // the driver's own estimate
  std::uint32_t buttons = 0;         // bit mask
  DeviceFault fault = DeviceFault::none;
};

struct DeviceLimits {
  double max_force_N = 0.0;
  double max_stiffness_N_per_m = 0.0;  // nominal
  double resolution_m = 0.0;           // encoder step; 0 for an ideal device
  double friction_N = 0.0;             // Coulomb friction of the mechanism
  // Size of the box that the tool can reach: x right, y up, z towards the person (m). Scenes are fitted to
  // it. A simulated device may leave it.
  glm::dvec3 workspace_m{std::numeric_limits<double>::infinity()};
};

// One servo tick is read() → compute → write(force). Neither call allocates, locks, throws or does I/O.
class HapticDevice {
 public:
  HapticDevice() = default;
  HapticDevice(HapticDevice&&) = delete;
  HapticDevice& operator=(HapticDevice&&) = delete;
  virtual ~HapticDevice() = default;

  // A device in the same state, which shares the hand's path; null for a real device. Allocates.
  [[nodiscard]] virtual std::unique_ptr<HapticDevice> copy() const { return nullptr; }
  // Takes the state of a device that copy() gave. Returns false for a real device.
  virtual bool go_back_to(const HapticDevice& /*kept*/) { return false; }

  [[nodiscard]] virtual DeviceState read() noexcept = 0;
  // The force on the hand (N, scene frame), held until the next write. A simulated device also advances by
  // dt_s.
  virtual void write(const glm::dvec3& force_N, double dt_s) noexcept = 0;
  // Call it if the next tick comes late, so that the force of the last write stays for another extra_s. A
  // simulated device advances by that time; its watchdog keeps counting from the last write. A real device
  // needs no call.
  virtual void delay(double /*extra_s*/) noexcept {}
  [[nodiscard]] virtual DeviceLimits limits() const noexcept = 0;
  [[nodiscard]] virtual std::string_view name() const noexcept = 0;

 protected:
  HapticDevice(const HapticDevice&) = default;
  HapticDevice& operator=(const HapticDevice&) = default;
};

}  // namespace device
