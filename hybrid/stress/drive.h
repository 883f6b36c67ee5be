// SPDX-License-Identifier: GPL-3.0-or-later
// Drives one case of the extremes suite from the first tick to rest, and collects the results.
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
  path,         // the scene's path: a hand, a device, a closed loop
  stalls,       // as `path`, but every 40th tick takes 1 to 100 ms, during which the force is held
  not_numbers,  // as `path`, but every 7th position is NaN, infinite, absurdly large, or denormal
  jumps,        // no hand: in each tick the tool is at another random place within 1,000 units of the middle
  through,      // no hand: the tool goes from above the block to 1,000 units below, or back, within one tick
};
inline constexpr std::array<Motion, 5> kMotions{Motion::path, Motion::stalls, Motion::not_numbers,
                                                Motion::jumps, Motion::through};
std::string_view name_of(Motion motion);

struct DriveResult {
  std::uint64_t ticks = 0, contact_ticks = 0, not_finite = 0, hash = 0;
  double most_N = 0.0, over_force_N = 0.0, over_slew_N = 0.0;
  double excess_J = 0.0, tolerance_J = 0.0, given_J = 0.0, allowed_J = 0.0,
         moved_J = 0.0;  // the energies are those of TickInvariants
  double most_given_J = 0.0, worst_tick_J = 0.0;
  double inside_m = 0.0, slowest_us = 0.0;
  double lowest_m = 0.0;      // Motion::through: lowest height of the proxy over the scene's middle
  double unbalanced_N = 0.0;  // force when the tool has been away for long
  double left_moved_m = 0.0;  // largest displacement at that time
  double most_moved_m = 0.0;  // largest displacement before
  bool asleep = true;         // has all tissue stopped relaxing at that time?
  std::uint32_t faults = 0;
  std::vector<glm::dvec3> force_N;  // in each tick before the tool leaves
};

// Drives the scene to rest. `middle_m` and `unit_m`: those of the scene's SceneSetting. Throws SceneError if
// the tool starts inside an object.
DriveResult drive(const Scene& scene, BuiltScene& built, Motion motion, const glm::dvec3& middle_m,
                  double unit_m);

// One of the positions that no device should give: NaN, infinities, 1e300 m, 1e30 m, denormals. `number`
// selects it.
glm::dvec3 no_position(std::uint64_t number) noexcept;

// Leads the tool from the proxy straight away from the middle, twice `reach_m` far. If an object is in the
// way, the tool moves along an axis instead. `tick` does one tick of 1 ms with the device at the given
// position. Returns the last position of the device.
glm::dvec3 lead_out(const World& world, WorldState& state, const glm::dvec3& middle_m, double reach_m,
                    const std::function<TickResult(const glm::dvec3&)>& tick);

// The largest displacement of all soft objects (m).
double largest_displacement_m(const WorldState& state);
bool all_asleep(const WorldState& state);

}  // namespace hybrid
