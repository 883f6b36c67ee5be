// SPDX-License-Identifier: GPL-3.0-or-later
// A player's session on a thread of its own, while a window shows it. The session publishes snapshots and the
// figures of every tick, and takes goals and edits. Neither waits for the other, with one exception: while a
// change is made or a state is kept, the session stands still.
#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <stdexcept>
#include <thread>

#include "device/loop/servo_loop.h"
#include "hybrid/base/flush_to_zero.h"
#include "hybrid/base/thread_time.h"
#include "hybrid/base/triple_buffer.h"
#include "hybrid/session/black_box.h"
#include "hybrid/session/player.h"
#include "hybrid/snapshot/merge_live_surface.h"

namespace hybrid {

class LiveSession {
 public:
  // Keeps references. The player has not begun yet, or goes on.
  LiveSession(Player& player, BlackBox& box)
      : player_(player), relaxation_(player_.go_live(1.0 / kSnapshotEvery_s)), box_(box) {
    player_.snapshot(snapshots_.back());
    snapshots_.publish();
    thread_ = std::jthread([this] { serve(); });
  }
  LiveSession(const LiveSession&) = delete;
  LiveSession& operator=(const LiveSession&) = delete;
  LiveSession(LiveSession&&) = delete;
  LiveSession& operator=(LiveSession&&) = delete;
  ~LiveSession() { stop(); }

  void ask(const PlayRequest& request) {
    asked_ = request.asked;
    requests_.back() = request;
    requests_.publish();
  }
  void shown(const DrawnScene& drawn, Snapshot& snapshot) {
    relaxation_->ask(asked_);
    merge_live_surface(drawn, snapshots_.take(), relaxation_->tissue(), asked_.get(), snapshot);
  }
  // Waits until the servo thread leaves the state alone. Returns false if it does not answer.
  bool hold(PlayRequest request) {
    request.hold = ++holds_;
    ask(request);
    for (int n = 0; n < kMostWaits && !ended_; ++n) {
      if (player_.held() == request.hold) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return ended_;
  }
  // Makes a change between two ticks: Player::change_scene() or go_back(). The session stands still
  // meanwhile. Throws what `change` throws, and std::runtime_error if the session does not answer.
  template <class Change>
  void change(PlayRequest request, const Change& change) {
    if (!hold(request)) throw std::runtime_error("the session does not answer; try again");
    relaxation_.reset();
    request.asked = nullptr;  // the points may belong to the previous scene
    const auto go_on = [&] {
      relaxation_ = player_.relaxation_thread(1.0 / kSnapshotEvery_s);
      ask(request);
    };
    try {
      change();
    } catch (...) {
      go_on();
      throw;
    }
    go_on();
    for (int n = 0; n < kMostWaits && !ended_ && snapshots_.take().scene != player_.scene_number(); ++n)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  // Calls `act` between two ticks; the session stands still meanwhile. For calls that do not change the
  // state: Player::keep_state(), compare_with_rest(). Does nothing if the session does not answer.
  template <class Act>
  void between_ticks(const PlayRequest& request, const Act& act) {
    if (!hold(request)) return;
    act();
    ask(request);
  }
  [[nodiscard]] bool ended() const { return ended_; }
  // Processor time of the servo thread and of the relaxation thread so far (s).
  [[nodiscard]] double processor_time_s() { return relaxation_s() + servo_s(); }
  [[nodiscard]] double relaxation_s() const { return relaxation_->busy_s(); }
  [[nodiscard]] double servo_s() { return ended_ ? 0.0 : thread_time_s(thread_.native_handle()); }
  device::ServoReport stop() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
    return report_;
  }

 private:
  static constexpr double kSnapshotEvery_s = 1.0 / 60.0;  // session time between two pictures
  static constexpr int kMostWaits = 500;                  // waits of 1 ms each

  device::ServoAnswer answer(const device::ServoInput& input) {
    const ScopedFlushToZero flushed;
    const bool go_on = !stop_.load(std::memory_order_relaxed);
    if (!go_on) return {.go_on = false, .skip = true};
    const bool ticked = player_.advance(requests_.take(), input);
    if (ticked) box_.add(black_box_row(input, player_.felt(), player_.ticks() - 1, player_.state()));
    if (ticked || player_.edited()) publish(ticked);
    return {.force_N = player_.felt().force_N, .skip = !ticked};
  }
  // Publishes a snapshot, at most 60 times a second of real time.
  void publish(bool ticked) {
    const auto now = std::chrono::steady_clock::now();
    if (ticked && now < next_) return;
    next_ = now + std::chrono::microseconds(static_cast<int>(1e6 * kSnapshotEvery_s));
    player_.shown();
    player_.snapshot(snapshots_.back(), requests_.take().asked.get());
    snapshots_.publish();
  }
  void serve() {
    auto tick = [this](const device::ServoInput& input) { return answer(input); };
    try {
      report_ = device::run_servo(
          player_.device(),
          {.rate_hz = player_.rate_hz(), .realtime = true, .deadline_s = player_.deadline_s()}, tick);
    } catch (const std::exception& e) {
      report_.end = device::ServoEnd::lost;
      report_.messages.emplace_back(e.what());
    }
    ended_ = true;
  }

  Player& player_;
  std::unique_ptr<RelaxationThread> relaxation_;
  BlackBox& box_;
  TripleBuffer<Snapshot> snapshots_;
  TripleBuffer<PlayRequest> requests_;
  std::shared_ptr<const AskedPoints> asked_;  // of the last request
  std::atomic<bool> stop_{false}, ended_{false};
  std::chrono::steady_clock::time_point next_{};
  std::uint32_t holds_ = 0;
  device::ServoReport report_;
  std::jthread thread_;
};

}  // namespace hybrid
