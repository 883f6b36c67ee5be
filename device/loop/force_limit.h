// SPDX-License-Identifier: GPL-3.0-or-later
// The last operations on any force before it reaches a motor: finite check, device and deadline, energy, soft
// start, slew rate, clamp.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>

#include "device/loop/haptic_device.h"

namespace device {

struct ForceLimits {
  double max_force_N = 8.5;
  double max_slew_N_per_s = 50e3;  // 50 N per millisecond: limits jumps of the force, but no contact
  double soft_start_s = 0.05;      // the force fades in over this time after the start and after a cut
  // A tick that takes longer has missed its deadline, and the force is cut. In 10 ms at 8.5 N a PHANToM
  // pushes a hand by 5 mm. A desktop without real-time priority cannot keep a much shorter deadline.
  double deadline_s = 10e-3;
  // Most energy given to the hand within any energy_window_s. Energy that the hand gives back is not
  // subtracted. 0.5 J in 0.1 s is 8.5 N at 0.6 m/s. No contact reaches that; an unstable loop does.
  double max_energy_J = 0.5;
  double energy_window_s = 0.1;
};

// Energy of the recent past, in slots of a sixteenth of the window. The sum covers the window plus at most
// one slot.
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
  glm::dvec3 last_m{0.0};  // tool position in the tick of last_N
  bool placed = false;     // last_m is known
  double elapsed_s = 0.0;  // time since the start or the last cut, at most soft_start_s
  EnergyWindow handed;
  std::uint64_t nonfinite = 0;       // commands that were not finite
  std::uint64_t clamped = 0;         // ticks with a clamped magnitude
  std::uint64_t slewed = 0;          // ticks with a limited step
  std::uint64_t late = 0;            // ticks that missed the deadline (dt, or DeviceFault::late)
  std::uint64_t lost = 0;            // ticks with any other device fault
  std::uint64_t energy_limited = 0;  // ticks that reached max_energy_J
};

// Order: finite check; device without fault, tick in time, energy below its limit; soft start; slew rate;
// clamp. If one of the first four checks fails, the force is zero at once. After a device fault, a late tick
// or the energy limit the force fades in anew. Only finite values enter the state. The energy exceeds its
// limit by at most the energy of one tick. Never throws, never allocates.
glm::dvec3 limit_force(const ForceLimits& limits, ForceLimitState& state, const glm::dvec3& command_N,
                       const DeviceState& tool, double dt_s) noexcept;
// For loops without a position: applies all limits but those of energy and device faults.
glm::dvec3 limit_force(const ForceLimits& limits, ForceLimitState& state, const glm::dvec3& command_N,
                       double dt_s) noexcept;

}  // namespace device
