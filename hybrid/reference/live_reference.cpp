// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/reference/live_reference.h"

#include <sched.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "hybrid/base/flush_to_zero.h"
#include "hybrid/feel/just_noticeable.h"
#include "hybrid/reference/rest_watch.h"

namespace hybrid {

PassedTick passed_tick(std::uint64_t tick, double t_s, const World& world, const WorldState& state,
                       const TickResult& felt) noexcept {
  return {.tick = tick,
          .t_s = t_s,
          .device_m = felt.device_m,
          .coupling_N = coupling_force_N(world, state, felt.device_m),
          .soft = std::any_of(state.reactions.begin(), state.reactions.end(),
                              [](const voxel::Reaction& reaction) { return reaction.pressed > 0; })};
}

std::string why_no_live_reference(const World& world, const WorldState& state) {
  if (state.soft.empty()) return "nothing in the scene is soft";
  for (const RigidObject& object : world.rigid) {
    if (object.motion.moves()) return "a rigid object moves, so nothing comes to rest";
  }
  for (const auto& object : state.soft) {
    if (object->lattice().has_plasticity()) return "tissue keeps dents, so its force depends on the past";
  }
  return {};
}

ReferenceSession::ReferenceSession(const World& world, std::unique_ptr<WorldState> state, double dt_s,
                                   double floor_N)
    : world_(world), state_(std::move(state)), dt_s_(dt_s), floor_N_(floor_N) {}

glm::dvec3 ReferenceSession::tick_at(const glm::dvec3& device_m) noexcept {
  const TickResult felt = haptic_tick(world_, *state_, {.position_m = device_m}, dt_s_);
  return coupling_force_N(world_, *state_, felt.device_m);
}

std::optional<ForceAtRest> ReferenceSession::follow(std::span<const PassedTick> passed) noexcept {
  if (passed.empty()) return std::nullopt;
  const PassedTick& last = passed.back();
  const bool soft =
      std::any_of(passed.begin(), passed.end(), [](const PassedTick& tick) { return tick.soft; });
  const std::size_t stride = soft ? passed.size() / kMostTicksOnWay + 1 : 1;
  for (std::size_t n = stride - 1; n + 1 < passed.size(); n += stride) (void)tick_at(passed[n].device_m);
  if (!last.soft) {
    (void)tick_at(last.device_m);
    return std::nullopt;
  }
  RestWatch rest(floor_N_);
  for (std::size_t n = 0; n < kMostTicksAtRest; ++n) {
    const glm::dvec3 now_N = tick_at(last.device_m);
    rest.see(now_N);
    if (rest.at_rest()) return ForceAtRest{last.t_s, last.coupling_N, now_N, noticeable_N(now_N, floor_N_)};
  }
  return std::nullopt;
}

LiveReference::LiveReference(const World& world, std::unique_ptr<WorldState> state, double dt_s,
                             double floor_N)
    : session_(world, std::move(state), dt_s, floor_N) {
  way_.reserve(kTicksWaiting);
  thread_ = std::thread([this] { run(); });
}

LiveReference::~LiveReference() {
  stop_.store(true, std::memory_order_relaxed);
  thread_.join();
}

void LiveReference::take_edits_until(std::uint64_t tick) noexcept {
  Edit edit;
  while (waiting_ || edits_.pop(edit)) {
    if (!waiting_) waiting_ = edit;
    if (waiting_->tick > tick) return;
    session_.take(*waiting_);
    waiting_.reset();
  }
}

void LiveReference::run() noexcept {
  // Takes the lowest priority. A session has precedence, and a late reference only gives fewer results.
  const sched_param none{};
  (void)sched_setscheduler(0, SCHED_IDLE, &none);
  set_flush_to_zero();  // as the tick does
  while (!stop_.load(std::memory_order_relaxed)) {
    way_.clear();
    PassedTick tick;
    while (way_.size() < kTicksWaiting && passed_.pop(tick)) way_.push_back(tick);
    if (way_.empty()) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      continue;
    }
    take_edits_until(way_.back().tick);
    if (const auto found = session_.follow(way_)) (void)found_.push(*found);
  }
}

}  // namespace hybrid
