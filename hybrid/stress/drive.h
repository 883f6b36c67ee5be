// SPDX-License-Identifier: GPL-3.0-or-later
// One case of the extremes suite, driven from the first tick to rest, and what was seen.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <string_view>
#include <vector>

#include "hybrid/build/build_world.h"
#include "hybrid/tick/tick.h"

namespace hybrid {

enum class Motion : std::uint8_t {
  path,         // the scene's own: a hand, a device, a closed loop
  stalls,       // the same, and every 40th tick takes 1 to 100 ms, through which the force is held
  not_numbers,  // the same, and every 7th position is NaN, infinite, beyond anything, or denormal
  jumps,        // no hand: anywhere within 1,000 units of the middle, another place each tick
  through,      // no hand: from above the block to 1,000 units below and back, in one tick
};
inline constexpr std::array<Motion, 5> kMotions{Motion::path, Motion::stalls, Motion::not_numbers,
                                                Motion::jumps, Motion::through};
std::string_view name_of(Motion motion);

struct DriveResult {
  std::uint64_t ticks = 0, contact_ticks = 0, not_finite = 0, hash = 0;
  double most_N = 0.0, over_force_N = 0.0, over_slew_N = 0.0;
  double excess_J = 0.0, tolerance_J = 0.0, given_J = 0.0, allowed_J = 0.0,
         moved_J = 0.0;  // of TickInvariants
  double most_given_J = 0.0, worst_tick_J = 0.0;
  double inside_m = 0.0, slowest_us = 0.0;
  double lowest_m = 0.0;      // of the proxy, above the middle of the scene, of Motion::through
  double unbalanced_N = 0.0;  // when the tool has been away for long: force,
  double left_moved_m = 0.0;  // largest displacement,
  double most_moved_m = 0.0;  // and the largest that was seen before
  bool asleep = true;         // and nothing soft is being relaxed
  std::uint32_t faults = 0;
  std::vector<glm::dvec3> force_N;  // of each tick before the tool leaves
};

// Drives the scene to rest. `middle_m` and `unit_m` of its SceneSetting. Throws SceneError: the tool starts
// inside something.
DriveResult drive(const Scene& scene, BuiltScene& built, Motion motion, const glm::dvec3& middle_m,
                  double unit_m);

// The next of the positions that no device should give: NaN, infinities, 1e300 m, denormals.
glm::dvec3 no_position(std::uint64_t number) noexcept;

// Leads the tool from where the proxy is straight away from the middle, twice `reach_m` far; where something
// stands in that way, along an axis. `tick` is one tick of 1 ms with the device there. Returns where the
// device was left.
glm::dvec3 lead_out(const World& world, WorldState& state, const glm::dvec3& middle_m, double reach_m,
                    const std::function<TickResult(const glm::dvec3&)>& tick);

// The largest displacement of anything soft (m).
double largest_displacement_m(const WorldState& state);
bool all_asleep(const WorldState& state);

}  // namespace hybrid
