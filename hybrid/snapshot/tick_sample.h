// SPDX-License-Identifier: GPL-3.0-or-later
// The figures of one tick for charts. A window draws at most 60 frames a second; it gets every tick between
// two frames, so that a spike of one tick is seen.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>

#include "hybrid/base/spsc_ring.h"
#include "hybrid/tick/tick.h"

namespace hybrid {

// Parts of the force on the hand; their sum is the whole force. rigid: without friction and damping. damping:
// with texture. limits and passivity: changes by the limits and by the passivity controller.
enum class ForcePart : std::uint8_t { rigid, soft, friction, damping, limits, passivity };
inline constexpr std::size_t kForceParts = 6;

struct TickSample {
  double t_s = 0.0;
  glm::dvec3 device_m{0.0}, proxy_m{0.0};  // scene frame
  glm::vec3 force_N{0.0F};                 // on the hand
  // Magnitude of the force on the hand after its limits, and of its rigid and soft parts before them.
  float total_N = 0.0F, rigid_N = 0.0F, soft_N = 0.0F;
  // Magnitudes of the further parts of TickResult.
  float friction_N = 0.0F, damping_N = 0.0F, limits_N = 0.0F, passivity_N = 0.0F;
  // [ForcePart] along the direction that the force has before its limits.
  std::array<float, kForceParts> along_N{};
  std::uint32_t contacts = 0;  // as in TickResult
  float tick_us = 0.0F;
  std::array<float, kStages> stage_us{};
  bool late = false;  // the servo loop missed a period before this tick
};

using TickSamples = SpscRing<TickSample>;

}  // namespace hybrid
