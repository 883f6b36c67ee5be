// SPDX-License-Identifier: GPL-3.0-or-later
// A session goes on in another world, between two ticks: the same scene with an object that was changed.
#pragma once

#include <atomic>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <string>

#include "hybrid/world/world_state.h"

namespace hybrid {

// The reason why no session can go from one of these worlds to the other, in words; empty: it can. No object
// may move, because its motion would go on in tissue that begins at rest.
[[nodiscard]] std::string why_no_take_over(const World& before, const World& after);

// `state`, which is at rest in `world`, continues the session of `before`. Clock, force limits, passivity and
// edited values go on; values of an object go to the object of the same name. Tissue begins at rest. The tool
// is put outside everything, and is then pressed in with the device at its present place until the force is
// steady. The ticks of this press do not count. The same arguments give the same state, bit by bit.
// Allocates. Returns false if there is no free place for the tool; `state` is useless then.
[[nodiscard]] bool take_over(const World& before_world, const WorldState& before, const World& world,
                             std::unique_ptr<WorldState>& state);

// The force at the device's present place when all tissue is at rest. Rigid objects must not move.
struct RestForce {
  glm::dvec3 force_N{0.0};
  bool steady = false;  // false: the force still changed by more than 0.2 % in a tenth of a second
  bool tissue = false;  // the tool presses tissue
};
// Any thread may call it while the state stays as it is. Ends early, with a force that is not steady, once
// `stop` is true.
[[nodiscard]] RestForce force_at_rest(const World& world, const WorldState& state,
                                      const std::atomic<bool>& stop);
// The same under a tool that comes from `outside_m` and stands at `device_m`. `fresh`: a state before its
// first tick. Empty: no place for the tool is free at `outside_m`, nor up to `most_way_m` away from it.
[[nodiscard]] std::optional<RestForce> press_to_rest(const World& world, const WorldState& fresh,
                                                     const glm::dvec3& device_m, const glm::dvec3& outside_m,
                                                     double most_way_m, const std::atomic<bool>& stop);

}  // namespace hybrid
