// SPDX-License-Identifier: GPL-3.0-or-later
// The last operations on any force before it reaches a motor.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>

namespace device {

struct ForceLimits {
  double max_force_N = 8.5;
  double max_slew_N_per_s = 50e3;  // 50 N a millisecond at most: stops steps, not contact
  double soft_start_s = 0.05;      // forces fade in over this time after the start
};

struct ForceLimitState {
  glm::dvec3 last_N{0.0};
  double elapsed_s = 0.0;
  std::uint64_t nonfinite = 0;  // commands that were not finite, and gave zero
  std::uint64_t clamped = 0;    // ticks in which the magnitude was cut
  std::uint64_t slewed = 0;     // ticks in which the step was cut
};

// finite check → soft start → slew → clamp. A non-finite command gives zero and never enters the state.
// Never throws, never allocates.
glm::dvec3 limit_force(const ForceLimits& limits, ForceLimitState& state, const glm::dvec3& command_N,
                       double dt_s) noexcept;

}  // namespace device
