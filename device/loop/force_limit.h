// SPDX-License-Identifier: GPL-3.0-or-later
// The last operations on any force before it reaches a motor.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>

#include "device/loop/haptic_device.h"

namespace device {

struct ForceLimits {
  double max_force_N = 8.5;
  double max_slew_N_per_s = 50e3;  // 50 N a millisecond at most: stops steps, not contact
  double soft_start_s = 0.05;      // forces fade in over this time after the start, and after being let go
  // A tick longer than this missed its deadline: the motors are let go. In 10 ms at 8.5 N a PHANToM pushes a
  // hand by 5 mm; much less than that a desktop without real-time priority does not keep.
  double deadline_s = 10e-3;
  // The energy handed to the hand within any energy_window_s: what was pushed along, and nothing taken off
  // for what the hand pushed back. 0.5 J in 0.1 s is 8.5 N at 0.6 m/s: no contact does that, a runaway does.
  double max_energy_J = 0.5;
  double energy_window_s = 0.1;
};

// Energy of late, in slots of a sixteenth of the window: what is told is of the window and up to a slot more.
class EnergyWindow {
 public:
  void add(double energy_J, double dt_s, double window_s) noexcept;
  [[nodiscard]] double sum_J() const noexcept;

 private:
  static constexpr std::size_t kSlots = 17;
  std::array<double, kSlots> energy_J_{};
  std::size_t newest_ = 0;
  double in_slot_s_ = 0.0;
};

struct ForceLimitState {
  glm::dvec3 last_N{0.0};
  glm::dvec3 last_m{0.0};  // where the tool was then
  bool placed = false;     // last_m is known
  double elapsed_s = 0.0;  // of the soft start, since the start or since the motors were last let go
  EnergyWindow handed;
  std::uint64_t nonfinite = 0;  // commands that were not finite, and gave zero
  std::uint64_t clamped = 0;    // ticks in which the magnitude was cut
  std::uint64_t slewed = 0;     // ticks in which the step was cut
  std::uint64_t late = 0;       // ticks that missed their deadline (dt, or DeviceFault::late), and gave zero
  std::uint64_t lost = 0;       // ticks with any other fault of the device, that gave zero
  std::uint64_t energy_limited = 0;  // ticks that gave zero because max_energy_J was reached
};

// finite check → device there, tick in time, energy within its limit → soft start → slew → clamp. What fails
// one of the first four gives zero at once; after the last three of them the force fades in anew. Nothing
// that is not finite enters the state. The energy is exceeded by one tick's at most: the one in which it was
// reached. Never throws, never allocates.
glm::dvec3 limit_force(const ForceLimits& limits, ForceLimitState& state, const glm::dvec3& command_N,
                       const DeviceState& tool, double dt_s) noexcept;
// For loops that know no position: everything but the energy and the device's faults.
glm::dvec3 limit_force(const ForceLimits& limits, ForceLimitState& state, const glm::dvec3& command_N,
                       double dt_s) noexcept;

}  // namespace device
