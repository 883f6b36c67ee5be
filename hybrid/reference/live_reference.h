// SPDX-License-Identifier: GPL-3.0-or-later
// Compares the force of a session with the force at rest, while the session goes on. A second session, the
// reference, follows the device of the first one on a thread of its own. At the newest position it waits
// until its tissue is at rest. Then it compares its force with the force that was felt there. The first
// session only adds each tick to a queue.
#pragma once

#include <atomic>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "hybrid/base/spsc_ring.h"
#include "hybrid/tick/tick.h"
#include "hybrid/world/edits.h"

namespace hybrid {

// A tick of the session. `coupling_N`: force between device and proxy. `soft`: something soft is in contact.
struct PassedTick {
  std::uint64_t tick = 0;
  double t_s = 0.0;
  glm::dvec3 device_m{0.0}, coupling_N{0.0};
  bool soft = false;
};

// The newest tick of a session, after which `state` is the session's state. `felt`: the tick's result.
[[nodiscard]] PassedTick passed_tick(std::uint64_t tick, double t_s, const World& world,
                                     const WorldState& state, const TickResult& felt) noexcept;

// The forces between device and proxy of one tick: as felt, and once all tissue is at rest.
// `noticeable_N`: the just noticeable difference (JND) of the force at rest.
struct ForceAtRest {
  double t_s = 0.0;
  glm::dvec3 felt_N{0.0}, at_rest_N{0.0};
  double noticeable_N = 0.0;
  // Difference of the two forces (JND).
  [[nodiscard]] double jnd() const noexcept { return glm::length(felt_N - at_rest_N) / noticeable_N; }
};

using ForcesAtRest = SpscRing<ForceAtRest>;

// Why no reference can follow the session; empty if one can.
[[nodiscard]] std::string why_no_live_reference(const World& world, const WorldState& state);

// The reference session.
class ReferenceSession {
 public:
  // `state`: a copy of the session's state (copy_state()). `floor_N`: least just noticeable difference. Keeps
  // a reference to `world`.
  ReferenceSession(const World& world, std::unique_ptr<WorldState> state, double dt_s, double floor_N);

  // Applies an edit of the session.
  void take(const Edit& edit) noexcept { (void)apply_edit(world_, *state_, edit); }
  // Plays these ticks to the last of them, and waits there for rest. Empty if nothing soft is in contact
  // there, or if the tissue is not at rest after kMostTicksAtRest ticks. In this case the next call goes on
  // waiting. Neither allocates nor throws.
  std::optional<ForceAtRest> follow(std::span<const PassedTick> passed) noexcept;

 private:
  // Greatest number of ticks in contact that a call plays, and of ticks in which it then waits. If there are
  // more ticks, every second is played, or every third, and so on.
  static constexpr std::size_t kMostTicksOnWay = 8, kMostTicksAtRest = 80;

  glm::dvec3 tick_at(const glm::dvec3& device_m) noexcept;

  const World& world_;
  std::unique_ptr<WorldState> state_;
  double dt_s_, floor_N_;
};

// The reference session on its thread, until this object is destroyed.
class LiveReference {
 public:
  // Arguments as for ReferenceSession. Allocates.
  LiveReference(const World& world, std::unique_ptr<WorldState> state, double dt_s, double floor_N);
  ~LiveReference();
  LiveReference(const LiveReference&) = delete;
  LiveReference& operator=(const LiveReference&) = delete;
  LiveReference(LiveReference&&) = delete;
  LiveReference& operator=(LiveReference&&) = delete;

  // ---- the servo thread ----
  // An edit is applied before the tick of its number. A tick that finds the queue full is dropped. The
  // reference then takes a shorter path to the next one.
  void passed(const PassedTick& tick) noexcept { (void)passed_.push(tick); }
  void edited(const Edit& edit) noexcept { (void)edits_.push(edit); }

  // ---- one reader ----
  [[nodiscard]] ForcesAtRest& found() noexcept { return found_; }

 private:
  // Ticks, edits and results that may wait: 4 s of ticks at 1 kHz.
  static constexpr std::size_t kTicksWaiting = 4096, kEditsWaiting = 256, kResultsWaiting = 1024;

  void run() noexcept;
  void take_edits_until(std::uint64_t tick) noexcept;

  ReferenceSession session_;
  SpscRing<PassedTick> passed_{kTicksWaiting};
  SpscRing<Edit> edits_{kEditsWaiting};
  ForcesAtRest found_{kResultsWaiting};
  std::vector<PassedTick> way_;
  std::optional<Edit> waiting_;  // the next edit, if it belongs to a later tick
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace hybrid
