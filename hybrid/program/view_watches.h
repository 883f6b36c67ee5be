// SPDX-License-Identifier: GPL-3.0-or-later
// Data of a session that its window shows beside the present state: kept states of the past, and the forces
// between objects.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "hybrid/session/live_session.h"
#include "hybrid/window/window.h"

namespace hybrid {

// The past states that the window shows, and from which the session goes on.
class PastView {
 public:
  // Fills the notes with the kept states. `now_s`: time of the session.
  static void add_notes(const Player& player, double now_s, SessionNotes& notes) {
    for (const KeptState& kept : player.kept()) {
      notes.kept_s.push_back(now_s - player.time_of(kept));
      notes.kept_bytes += kept.bytes;
    }
  }
  // The kept state that is shown; empty: the present.
  static std::optional<std::size_t> shown(const Player& player, double now_s, double back_s) {
    if (!(back_s > 0.0) || player.kept().empty()) return {};
    std::size_t nearest = 0;
    const auto apart = [&](std::size_t n) {
      return std::abs(now_s - back_s - player.time_of(player.kept()[n]));
    };
    for (std::size_t n = 1; n < player.kept().size(); ++n) {
      if (apart(n) < apart(nearest)) nearest = n;
    }
    return nearest;
  }
  // The picture of that state. It is filled again only if the state or the points are other ones.
  const Snapshot& snapshot(const Player& player, std::size_t n, const AskedPoints* asked,
                           const std::shared_ptr<const FeltDifference>& difference) {
    const KeptState& kept = player.kept()[n];
    const std::uint64_t number = asked != nullptr ? asked->number : 0;
    if (state_ != kept.state.get() || snapshot_.asked.number != number) {
      player.snapshot_of(kept, snapshot_, asked);
      snapshot_.presses = player.presses_of(*kept.state);
      state_ = kept.state.get();
    }
    snapshot_.difference = difference;
    return snapshot_;
  }
  // Call when the kept states are other ones.
  void forget() { state_ = nullptr; }

 private:
  const WorldState* state_ = nullptr;  // of snapshot_
  Snapshot snapshot_;
};

// Keeps the forces between objects for the window's list. To compute them the session is held for a moment:
// a simulated hand does not notice, because held time does not count. A real hand would, so with a real
// device they are computed only while the session is paused.
class PressWatch {
 public:
  const std::vector<PairPress>& presses(const WindowInput& input, const PlayRequest& request,
                                        const Player& player, LiveSession& session, std::uint64_t tick) {
    const auto now = std::chrono::steady_clock::now();
    if (!input.wants_presses || (player.is_real() && !request.paused)) {
      presses_.clear();
      tick_ = kNever;
    } else if (tick != tick_ && now >= next_ && session.hold(request)) {
      presses_ = player.presses();
      session.ask(request);
      tick_ = tick;
      const auto end = std::chrono::steady_clock::now();
      next_ = end + std::max<std::chrono::steady_clock::duration>(kEvery, kRest * (end - now));
    }
    return presses_;
  }

 private:
  static constexpr std::uint64_t kNever = ~std::uint64_t{0};
  static constexpr std::chrono::milliseconds kEvery{200};  // least time between two updates of the list
  static constexpr int kRest = 19;  // the session is held for at most one part in 20 of the time
  std::vector<PairPress> presses_;
  std::uint64_t tick_ = kNever;  // of presses_
  std::chrono::steady_clock::time_point next_{};
};

}  // namespace hybrid
