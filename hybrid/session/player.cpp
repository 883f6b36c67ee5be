// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/session/player.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "hybrid/base/flush_to_zero.h"
#include "hybrid/feel/just_noticeable.h"
#include "hybrid/session/pair_presses.h"
#include "hybrid/snapshot/fill_snapshot.h"
#include "hybrid/tick/copy_state.h"
#include "hybrid/tick/take_over.h"
#include "hybrid/tick/tissue/async_relaxation.h"

namespace hybrid {
namespace {

constexpr double kHandSpeed_m_per_s = 0.5;  // speed of a brisk hand; a mouse could be faster

// The parts of a force along the direction that it has before its limits; none without a force.
std::array<float, kForceParts> parts_along(const TickResult& felt) noexcept {
  const glm::dvec3 whole_N = felt.rigid_N + felt.soft_N;
  const double length_N = glm::length(whole_N);
  std::array<float, kForceParts> along_N{};
  if (!(length_N > 0.0)) return along_N;
  const auto part = [&](ForcePart of, const glm::dvec3& force_N) {
    along_N[static_cast<std::size_t>(of)] = static_cast<float>(glm::dot(force_N, whole_N) / length_N);
  };
  part(ForcePart::rigid, felt.rigid_N - felt.friction_N - felt.damping_N);
  part(ForcePart::soft, felt.soft_N);
  part(ForcePart::friction, felt.friction_N);
  part(ForcePart::damping, felt.damping_N);
  part(ForcePart::limits, felt.limits_N);
  part(ForcePart::passivity, felt.passivity_N);
  return along_N;
}

TickSample sample_of(const TickResult& felt, double t_s, double late_s, double dt_s) noexcept {
  return {.t_s = t_s,
          .device_m = felt.device_m,
          .proxy_m = felt.proxy_m,
          .force_N = glm::vec3(felt.force_N),
          .total_N = static_cast<float>(glm::length(felt.force_N)),
          .rigid_N = static_cast<float>(glm::length(felt.rigid_N)),
          .soft_N = static_cast<float>(glm::length(felt.soft_N)),
          .friction_N = static_cast<float>(glm::length(felt.friction_N)),
          .damping_N = static_cast<float>(glm::length(felt.damping_N)),
          .limits_N = static_cast<float>(glm::length(felt.limits_N)),
          .passivity_N = static_cast<float>(glm::length(felt.passivity_N)),
          .along_N = parts_along(felt),
          .contacts = felt.contacts,
          .tick_us = static_cast<float>(felt.tick_us),
          .stage_us = felt.stage_us,
          .late = late_s >= dt_s};
}

std::size_t voxels_of(const WorldState& state) {
  std::size_t voxels = 0;
  for (const auto& object : state.soft) voxels += object->lattice().voxel_count();
  return voxels;
}

// Memory of a state (bytes) without the lattices, which all states of a scene share.
std::size_t bytes_of(const WorldState& state) {
  std::size_t bytes = sizeof state + state.map.memory_bytes();
  for (const auto& object : state.soft) bytes += object->memory_bytes() - object->lattice().memory_bytes();
  for (const auto& queries : state.obstacle_queries) bytes += queries.capacity() * sizeof queries.front();
  return bytes;
}

}  // namespace

std::optional<ComparedForces> compare_at_rest(const BuiltScene& before, const World& world,
                                              const WorldState& after, double jnd_floor_N,
                                              const std::atomic<bool>& stop) {
  const ScopedFlushToZero flushed;
  const RestForce was = force_at_rest(*before.world, *before.state, stop);
  const RestForce is = force_at_rest(world, after, stop);
  if (stop) return std::nullopt;
  return ComparedForces{.before_N = glm::length(was.force_N),
                        .after_N = glm::length(is.force_N),
                        .difference_jnd = jnd_of(is.force_N, was.force_N, jnd_floor_N),
                        .at_rest = was.steady && is.steady};
}

glm::dvec3 SteeredPath::position(double t_s) const noexcept {
  return now_.dragged ? now_.goal_m
                      : path_->position(std::fmod(t_s - now_.start_s, path_->duration_s() + 1.0));
}

void SteeredPath::drag_to(const glm::dvec3& goal_m) noexcept {
  now_.dragged = true;
  now_.goal_m = goal_m;
}

void SteeredPath::restart(double now_s) noexcept {
  now_.dragged = false;
  now_.start_s = now_s;
}

Player::Player(const Scene& scene, BuiltScene& built, const DrawnScene& drawn,
               device::HapticDevice* real_device)
    : scene_(&scene),
      built_(&built),
      drawn_(&drawn),
      path_(std::make_shared<SteeredPath>(scene_path(scene))),
      simulated_(real_device == nullptr ? scene_device(scene, path_) : nullptr),
      device_(real_device == nullptr ? *simulated_ : *real_device),
      rate_hz_(scene.rate_hz),
      dt_s_(1.0 / scene.rate_hz) {
  set_flush_to_zero();
  recorded_.reserve(static_cast<std::size_t>(kMostRecorded_s * rate_hz_));
  applied_.reserve(kMostEdits);
  start_m_ = goal_m_ = device_.read().position_m;
  felt_.device_m = felt_.proxy_m = start_m_;
  begin_session(scene, *built.world, *built.state, start_m_);
}

std::unique_ptr<RelaxationThread> Player::go_live(double surfaces_hz) {
  live_ = async_ = true;
  arrival_ = Arrival::thread;
  start_async_relaxation(*built_->state, arrival_);
  return relaxation_thread(surfaces_hz);
}

std::unique_ptr<RelaxationThread> Player::relaxation_thread(double surfaces_hz) {
  return std::make_unique<RelaxationThread>(*built_->world, built_->state->async, surfaces_hz);
}

void Player::relax_at_once() {
  async_ = true;
  start_async_relaxation(*built_->state, arrival_);
}

ChangeMade Player::change_scene(const Scene& scene, BuiltScene& built, const DrawnScene& drawn,
                                const std::string& text) {
  const std::string why_not = why_no_take_over(*built_->world, *built.world);
  if (!why_not.empty())
    throw std::runtime_error(why_not + ", so the scene cannot change while it is felt; change its file");
  if (changes_.size() == kMostChanges) throw std::runtime_error("the session has changed too often");
  take_edits();  // the waiting edits belong to the old scene
  const std::size_t voxels_before = voxels_of(*built_->state);
  if (!take_over(*built_->world, *built_->state, *built.world, built.state))
    throw std::runtime_error("the changed scene leaves the tool no free place; move the tool away first");
  std::unique_ptr<WorldState> after = kept_copy(*built.world, *built.state);
  if (async_) start_async_relaxation(*built.state, arrival_);
  scene_ = &scene;
  built_ = &built;
  drawn_ = &drawn;
  changes_.push_back({.tick = ticks_, .edits_before = applied_.size(), .text = text});
  kept_.clear();
  ++scenes_;
  edited_ = true;
  if (reference_) begin_reference();
  return {{.t_s = t_s(), .voxels_before = voxels_before, .voxels_after = voxels_of(*built_->state)},
          std::move(after)};
}

// States are kept as often as they will fit, so that few are copied in vain.
bool Player::keeps_at(double t_s) const noexcept {
  if (is_real()) return false;
  if (kept_.empty()) return true;
  const double share = static_cast<double>(kept_.back().bytes) / static_cast<double>(kMostKeptBytes);
  return t_s - time_of(kept_.back()) >= std::max(kKeepEvery_s, share * kKept_s);
}

void Player::keep_state() {
  if (!keeps_at(t_s())) return;
  take_edits();
  KeptState now{.ticks = ticks_,
                .hash = hash_,
                .edits = applied_.size(),
                .changes = changes_.size(),
                .state = kept_copy(*built_->world, *built_->state),
                .device = device_.copy(),
                .steering = path_->steering(),
                .goal_m = goal_m_,
                .felt = felt_};
  now.state->feel = built_->state->feel;
  now.bytes = bytes_of(*now.state);
  kept_.push_back(std::move(now));
  while (t_s() - time_of(kept_.front()) > kKept_s) kept_.pop_front();
  thin_out_kept();
}

// Drops states until they fit, each time the one whose neighbours are nearest to one another. So the minute
// stays covered, and the oldest and the newest state stay.
void Player::thin_out_kept() {
  const auto bytes = [this] {
    return std::accumulate(kept_.begin(), kept_.end(), std::size_t{0},
                           [](std::size_t sum, const KeptState& kept) { return sum + kept.bytes; });
  };
  while (kept_.size() > 2 && bytes() > kMostKeptBytes) {
    std::size_t least = 1;
    const auto gap = [this](std::size_t n) { return kept_[n + 1].ticks - kept_[n - 1].ticks; };
    for (std::size_t n = 2; n + 1 < kept_.size(); ++n) {
      if (gap(n) < gap(least)) least = n;
    }
    kept_.erase(kept_.begin() + static_cast<std::ptrdiff_t>(least));
  }
}

void Player::go_back(std::size_t n) {
  if (n >= kept_.size()) throw std::runtime_error("that state is no longer kept");
  if (changes_.size() >= kMostChanges) throw std::runtime_error("the session has changed too often");
  take_edits();  // the waiting edits are forgotten too
  kept_.erase(kept_.begin() + static_cast<std::ptrdiff_t>(n) + 1, kept_.end());
  const KeptState& kept = kept_.back();
  built_->state = copy_state(*built_->world, *kept.state);
  built_->state->feel = kept.state->feel;
  if (async_) start_async_relaxation(*built_->state, arrival_);
  (void)device_.go_back_to(*kept.device);
  path_->steer_as(kept.steering);
  goal_m_ = kept.goal_m;
  felt_ = kept.felt;
  ticks_ = kept.ticks;
  hash_ = kept.hash;
  due_ = 0.0;
  whole_ = whole_ || recorded_.size() >= kept.ticks;
  recorded_.resize(std::min<std::size_t>(recorded_.size(), kept.ticks));
  applied_.resize(kept.edits);
  changes_.resize(kept.changes);
  changes_.push_back({.tick = ticks_, .edits_before = applied_.size(), .text = {}});
  edited_ = true;
  if (reference_) begin_reference();
}

// Ends the reference if none can follow the session.
void Player::begin_reference() {
  reference_.reset();
  if (!why_no_live_reference(*built_->world, *built_->state).empty()) return;
  std::unique_ptr<WorldState> state = copy_state(*built_->world, *built_->state);
  state->feel = built_->state->feel;
  reference_ = std::make_unique<LiveReference>(*built_->world, std::move(state), dt_s_, jnd_floor_N(*scene_));
}

std::string Player::compare_with_rest(bool on) {
  if (!on) {
    reference_.reset();
    return {};
  }
  take_edits();
  begin_reference();
  return why_no_live_reference(*built_->world, *built_->state);
}

void Player::snapshot_of(const KeptState& kept, Snapshot& out, const AskedPoints* asked) const {
  fill_figures(out, *kept.state, kept.felt, kept.ticks);
  fill_moved(*built_->world, *kept.state, out);
  out.asked.number = 0;
  if (asked != nullptr) fill_asked(*built_->world, *kept.state, *asked, false, out);
}

void Player::take_edits() noexcept {
  Edit edit;
  while (applied_.size() < kMostEdits && edits_.pop(edit)) {
    edit.tick = ticks_;
    if (apply_edit(*built_->world, *built_->state, edit)) {
      applied_.push_back(edit);
      if (reference_) reference_->edited(edit);
    }
    edited_ = true;
  }
}

bool Player::tick_is_due(const PlayRequest& request) noexcept {
  if (request.paused) {
    if (request.single_ticks == single_ticks_) return false;
    ++single_ticks_;
    return true;
  }
  single_ticks_ = request.single_ticks;
  if (simulated_ == nullptr || !(request.speed < 1.0)) return true;
  due_ += std::max(request.speed, 0.0);
  if (due_ < 1.0) return false;
  due_ -= 1.0;
  return true;
}

// After a drag the tool stays at the last goal of the drag until a restart.
void Player::steer(const PlayRequest& request) noexcept {
  if (request.restarts != restarts_) {
    restarts_ = request.restarts;
    path_->restart(t_s());
  }
  if (!request.dragging) return;
  const glm::dvec3 delta = request.goal_m - goal_m_;
  const double length = glm::length(delta), most = kHandSpeed_m_per_s * dt_s_;
  goal_m_ = length > most ? goal_m_ + delta * (most / length) : request.goal_m;
  path_->drag_to(goal_m_);
}

void Player::keep(device::DeviceFault fault) noexcept {
  hash_ = hash_tick(hash_, felt_);
  if (recorded_.size() == recorded_.capacity()) {
    whole_ = false;
    return;
  }
  recorded_.push_back({felt_.device_m, hash_, fault, built_->state->async.arrived, 0});
}

bool Player::advance(const PlayRequest& request, const device::ServoInput& input) noexcept {
  held_.store(request.hold, std::memory_order_release);
  if (request.hold != 0) return false;
  take_edits();
  if (!tick_is_due(request)) return false;
  steer(request);
  felt_ = haptic_tick(*built_->world, *built_->state, input.device, dt_s_);
  if (!request.dragging) goal_m_ = felt_.device_m;
  keep(input.device.fault);
  samples_.push(sample_of(felt_, t_s(), input.late_s, dt_s_));
  if (reference_) reference_->passed(passed_tick(ticks_, t_s(), *built_->world, *built_->state, felt_));
  ++ticks_;
  return true;
}

void Player::step(const PlayRequest& request) {
  if (advance(request, {.device = device_.read(), .dt_s = dt_s_})) device_.write(felt_.force_N, dt_s_);
}

void Player::fill_figures(Snapshot& out, const WorldState& state, const TickResult& felt,
                          std::uint64_t ticks) const {
  if (out.scene != scene_number()) out = Snapshot();
  out.scene = scene_number();
  out.tick = state.tick;
  out.t_s = dt_s_ * static_cast<double>(ticks);
  out.device_m = felt.device_m;
  out.proxy_m = felt.proxy_m;
  out.force_N = felt.force_N;
  out.feel = state.feel;
  out.tick_us = felt.tick_us;
  fill_values(*built_->world, state, *drawn_, out);
}

void Player::snapshot(Snapshot& out, const AskedPoints* asked) const {
  fill_figures(out, *built_->state, felt_, ticks_);
  if (live_) {
    fill_moved_near(*built_->world, *built_->state, out);
  } else {
    fill_moved(*built_->world, *built_->state, out);
  }
  if (asked != nullptr) {
    fill_asked(*built_->world, *built_->state, *asked, live_, out);
  } else {
    out.asked.number = 0;
  }
}

std::vector<PairPress> Player::presses_of(const WorldState& state) const {
  return pair_presses(*built_->world, state);
}

Recording Player::recording(const std::string& scene_text) const {
  if (!whole_) {
    throw std::runtime_error(
        fmt::format("the session is longer than the {:.0f} min that a window records; "
                    "restart the window and record a shorter one",
                    kMostRecorded_s / 60.0));
  }
  return {.scene_file = std::filesystem::absolute(scene_->file),
          .scene_text = scene_text,
          .dt_s = dt_s_,
          .device = scene_limits(*scene_),
          .async_relaxation = async_,
          .state_hash = hash_state(hash_, *built_->state),
          .start_m = start_m_,
          .ticks = recorded_,
          .edits = applied_,
          .changes = changes_};
}

}  // namespace hybrid
