// SPDX-License-Identifier: GPL-3.0-or-later
// The haptic tick: from where the device is to the force on the hand.
#pragma once

#include <array>
#include <cstdint>

#include "device/loop/haptic_device.h"
#include "hybrid/world/world_state.h"

namespace hybrid {

// The stages in the order in which haptic_tick() calls them.
enum class Stage : std::uint8_t {
  bodies,       // bodies that move go on, and carry or push the proxy
  broad_phase,  // what the occupancy map says of the proxy's neighbourhood
  contact,      // bodies press tissue; proxy, rigid planes and tissue answer one another
  background,   // tissue away from the contact goes on to its equilibrium
  arbitration,  // soft objects, tool and bodies give way to one another
  map,          // the occupancy map learns where surface voxels are
  force,        // the force is made safe and published
};
inline constexpr std::size_t kStages = 7;
inline constexpr std::array<const char*, kStages> kStageNames{
    "bodies", "broad_phase", "contact", "background", "arbitration", "map", "force"};

struct TickResult {
  glm::dvec3 device_m{0.0};  // scene frame, as used (the last good input)
  glm::dvec3 proxy_m{0.0};
  glm::dvec3 force_N{0.0};               // on the hand, after the limits
  glm::dvec3 rigid_N{0.0}, soft_N{0.0};  // its parts before the limits: rigid_N + soft_N = K (proxy − device)
                                         // and what damping and texture add
  std::uint32_t contacts = 0;  // bit per object, rigid ones first; objects beyond 31 share the last bit
  std::array<float, kStages> stage_us{};
  double tick_us = 0.0;  // processor time of this thread; the stages are wall time
};

// One tick of dt_s. A pure function of (world, state, input, dt_s): the same inputs give the same bits (times
// apart). Never allocates, locks, throws or does I/O; every loop is bounded. Any input will do: in place of a
// position that is not finite, or further away than 1e12 m, the last good one holds (fault_nonfinite_input);
// a dt_s that is negative or not finite is 0, in which no time passes, and none is longer than a day.
TickResult haptic_tick(const World& world, WorldState& state, const device::DeviceState& input,
                       double given_dt_s) noexcept;

}  // namespace hybrid
