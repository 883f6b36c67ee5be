// SPDX-License-Identifier: GPL-3.0-or-later
// The small interface every device is served through, real, simulated or replayed.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <string_view>

namespace device {

struct DeviceState {
  glm::dvec3 position_m{0.0};        // tool centre, scene frame, as the encoders tell it
  glm::dvec3 velocity_m_per_s{0.0};  // the driver's own estimate
  std::uint32_t buttons = 0;         // bit mask
};

struct DeviceLimits {
  double max_force_N = 0.0;
  double max_stiffness_N_per_m = 0.0;  // nominal
  double resolution_m = 0.0;           // encoder step; 0 for an ideal device
  double friction_N = 0.0;             // Coulomb, of the mechanism
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
  [[nodiscard]] virtual DeviceLimits limits() const noexcept = 0;
  [[nodiscard]] virtual std::string_view name() const noexcept = 0;
};

}  // namespace device
