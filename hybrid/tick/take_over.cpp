// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tick/take_over.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <vector>

#include "hybrid/tick/copy_state.h"
#include "hybrid/tick/tick.h"
#include "hybrid/tick/tissue/async_relaxation.h"
#include "hybrid/tick/tissue/leave_tissue.h"
#include "hybrid/world/edits.h"

namespace hybrid {
namespace {

// Greatest number of ticks in which the tool is pressed in: for a session that goes on; for a comparison of
// forces.
constexpr int kMostPressing = 400, kMostResting = 1500;
// The force is steady if it changes by no more than this over kSteadyTicks, which are two relaxations of all
// tissue.
constexpr int kSteadyTicks = 100;
constexpr double kSteadyShare = 0.002, kSteady_N = 2e-4;

template <class Objects>
std::size_t number_of(const Objects& objects, const std::string& name) {
  const auto at = std::ranges::find(
      objects, name, [](const auto& object) -> const auto& { return object.name; });
  return static_cast<std::size_t>(at - objects.begin());
}

// Takes over edited values. Those of an object that changed from soft to rigid, or back, are dropped.
void take_edited_values(const World& before_world, const WorldState& before, const World& world,
                        WorldState& state) {
  state.edited.coupling_N_per_m = before.edited.coupling_N_per_m;
  state.edited.max_force_N = before.edited.max_force_N;
  for (std::size_t o = 0; o < world.rigid.size(); ++o) {
    const std::size_t old = number_of(before_world.rigid, world.rigid[o].name);
    if (old < before_world.rigid.size()) state.edited.feel[o] = before.edited.feel[old];
  }
  for (std::size_t o = 0; o < world.soft.size(); ++o) {
    const std::size_t old = number_of(before_world.soft, world.soft[o].name);
    const auto number = static_cast<std::uint32_t>(world.rigid.size() + o);
    if (old < before_world.soft.size() && edit_range(world, state, number, EditedQuantity::tissue_factor))
      state.edited.tissue_factor[o] = before.edited.tissue_factor[old];
  }
}

// Relaxes all tissue every few ticks. Without that, tissue of unlike stiffness may not come to rest. Returns
// the force when it is steady.
RestForce stand_still(const World& world, WorldState& state, int most_ticks, const std::atomic<bool>& stop) {
  start_async_relaxation(state, Arrival::at_once);
  const device::DeviceState still{.position_m = state.device_m};
  RestForce rest;
  for (int n = 1; n <= most_ticks && !rest.steady && !stop.load(std::memory_order_relaxed); ++n) {
    const TickResult felt = haptic_tick(world, state, still, 1e-3);
    if (n % kSteadyTicks != 0) continue;
    const glm::dvec3 now = coupling_force_N(world, state, felt.device_m);
    rest.steady = glm::length(now - rest.force_N) <= std::max(kSteady_N, kSteadyShare * glm::length(now));
    rest.force_N = now;
  }
  rest.tissue =
      std::ranges::any_of(state.reactions, [](const auto& reaction) { return reaction.pressed > 0; });
  return rest;
}

}  // namespace

std::string why_no_take_over(const World& before, const World& after) {
  for (const World* world : {&before, &after}) {
    for (const RigidObject& object : world->rigid) {
      if (object.motion.moves()) return "\"" + object.name + "\" moves";
    }
  }
  return {};
}

bool take_over(const World& before_world, const WorldState& before, const World& world,
               std::unique_ptr<WorldState>& state) {
  take_edited_values(before_world, before, world, *state);
  if (!start_outside(world, *state, before.device_m, before.proxy_m, before.proxy_m - before.device_m))
    return false;
  (void)stand_still(world, *state, kMostPressing, std::atomic<bool>(false));
  if (std::ranges::any_of(state->async.objects, [](const auto& object) { return object != nullptr; })) {
    const std::vector<ObjectFeel> feel = state->feel;
    state = copy_state(world, *state);  // without asynchronous relaxation
    state->feel = feel;
  }
  state->limit = before.limit;
  state->passive = before.passive;
  state->clock = before.clock;
  state->tick = before.tick;
  state->nonfinite = before.nonfinite;
  state->faults |= before.faults;
  state->truncated_ticks = before.truncated_ticks;
  return true;
}

RestForce force_at_rest(const World& world, const WorldState& state, const std::atomic<bool>& stop) {
  if (state.proxy_m == state.device_m) return {.steady = true};  // nothing is touched
  const std::unique_ptr<WorldState> copy = copy_state(world, state);
  return stand_still(world, *copy, kMostResting, stop);
}

std::optional<RestForce> press_to_rest(const World& world, const WorldState& fresh,
                                       const glm::dvec3& device_m, const glm::dvec3& outside_m,
                                       double most_way_m, const std::atomic<bool>& stop) {
  const std::unique_ptr<WorldState> copy = copy_state(world, fresh);
  if (!start_outside(world, *copy, device_m, outside_m, outside_m - device_m) ||
      glm::distance(copy->proxy_m, outside_m) > most_way_m)
    return std::nullopt;
  return stand_still(world, *copy, kMostResting, stop);
}

}  // namespace hybrid
