// SPDX-License-Identifier: GPL-3.0-or-later
// The haptic tick: maps a device position to the force on the hand.
#pragma once

#include <array>
#include <cstdint>

#include "device/loop/haptic_device.h"
#include "hybrid/world/world_state.h"

namespace hybrid {

// Stages of haptic_tick(), in the order of calls if soft objects can meet. Otherwise background is called
// after arbitration.
enum class Stage : std::uint8_t {
  bodies,       // bodies move, and carry or push the proxy
  broad_phase,  // finds the contents of the occupancy map around the proxy
  contact,      // bodies press tissue; proxy, rigid planes and tissue reach their minimum together
  background,   // tissue away from the contact relaxes towards its equilibrium
  arbitration,  // soft objects, tool and bodies give way to one another
  map,          // the occupancy map follows the surface voxels
  force,        // the force is made safe and published
};
inline constexpr std::size_t kStages = 7;
inline constexpr std::array<const char*, kStages> kStageNames{
    "bodies", "broad_phase", "contact", "background", "arbitration", "map", "force"};

// Bit of TickResult::contacts that all objects from this index on share.
inline constexpr std::size_t kLastContactBit = 31;

struct TickResult {
  glm::dvec3 device_m{0.0};  // scene frame, as used: the last valid input
  glm::dvec3 proxy_m{0.0};
  glm::dvec3 force_N{0.0};     // on the hand, after the limits
  glm::dvec3 coupling_N{0.0};  // of the virtual coupling on the hand, before the limits
  // Parts of the force before the limits: rigid_N + soft_N = coupling_N plus damping and texture.
  glm::dvec3 rigid_N{0.0}, soft_N{0.0};
  // Within rigid_N: friction with shading; damping with texture.
  glm::dvec3 friction_N{0.0}, damping_N{0.0};
  // Changes of the force by the limits, and then by the passivity controller. So force_N = rigid_N + soft_N +
  // limits_N + passivity_N, up to rounding.
  glm::dvec3 limits_N{0.0}, passivity_N{0.0};
  // A bit per object, rigid ones first; all objects from the 32nd on share the last bit.
  std::uint32_t contacts = 0;
  std::array<float, kStages> stage_us{};  // CPU time of this thread
  double tick_us = 0.0;                   // the sum of the stages
};

// One tick of `given_dt_s`. Except for measured times, it is a pure function of world, state, input and
// given_dt_s: the same inputs give the same bits. Never allocates, locks, throws or does I/O; every loop is
// bounded. Any input is accepted. A position that is not finite or beyond 1e12 m is replaced by the last
// valid one (fault_nonfinite_input). If given_dt_s is negative or not finite, no time passes. If it is longer
// than a day, it is shortened to a day.
TickResult haptic_tick(const World& world, WorldState& state, const device::DeviceState& input,
                       double given_dt_s) noexcept;

}  // namespace hybrid
