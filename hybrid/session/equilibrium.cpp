// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/session/equilibrium.h"

#include <algorithm>
#include <glm/geometric.hpp>

#include "device/loop/stop_signal.h"
#include "hybrid/tick/tick.h"

namespace hybrid {
namespace {

constexpr int kSettleTicks = 1200;  // the most ticks that equilibrium_force() runs
constexpr int kStillTicks = 40;     // ticks over which the force must stay within the tolerance

// Do the anchors carry the felt force of each object that only the tool presses? Standing still does not
// prove equilibrium. In a deep push with active limits all around, nothing may move from one cycle to the
// next. Yet half of the load may not have reached the anchors, or may not be felt.
bool carried_by_anchors(const World& world, const WorldState& state) noexcept {
  // largest difference of the two forces: share of the felt force, but at least kLeast_N
  constexpr double kShare = 0.01, kLeast_N = 1e-3;
  if (!world.soft_pairs.empty()) return true;
  for (std::size_t o = 0; o < state.soft.size(); ++o) {
    const voxel::SoftObject& object = *state.soft[o];
    if (state.reactions[o].pressed == 0 || !object.obstacles().empty() || object.lattice().has_plasticity() ||
        object.lattice().has_bricks())
      continue;
    const auto carried = object.carried_by_anchors_N();
    if (!carried) continue;
    const glm::dvec3 felt = glm::inverse(world.soft[o].pose.rotation) * state.reactions[o].force_N;
    if (glm::length(felt + *carried) > std::max(kLeast_N, kShare * glm::length(felt))) return false;
  }
  return true;
}

}  // namespace

std::optional<glm::dvec3> equilibrium_force(const World& world, const WorldState& state, double tolerance_N) {
  const std::unique_ptr<WorldState> copy = copy_state(world, state);
  World settling = world;
  for (RigidObject& object : settling.rigid) object.motion = {};  // moving bodies stand still meanwhile
  std::fill(copy->body_moved_m.begin(), copy->body_moved_m.end(), 0.0);
  for (const auto& object : copy->soft) object->widen_patches();
  const device::DeviceState still{.position_m = state.device_m};
  glm::dvec3 before(0.0);
  for (int n = 1; n <= kSettleTicks && device::stop_signal() == 0; ++n) {
    const TickResult felt = haptic_tick(settling, *copy, still, 1e-3);
    if (n % kStillTicks != 0) continue;
    const glm::dvec3 force = world.tool.stiffness_N_per_m * (felt.proxy_m - felt.device_m);
    if (glm::length(force - before) < tolerance_N && carried_by_anchors(settling, *copy)) return force;
    before = force;
  }
  return std::nullopt;
}

}  // namespace hybrid
