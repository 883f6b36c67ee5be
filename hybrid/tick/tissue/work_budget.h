// SPDX-License-Identifier: GPL-3.0-or-later
// How much of its counted work a tick in real time does at a contact, so that it is no later on a slow
// machine than on a fast one.
//
// Work is counted, never timed, so that the same inputs give the same bits; how long it takes is the
// machine's doing. In real time the share of it that a tick has follows what ticks take. Less of it is a
// contact that comes to rest some ticks later, as the hand moves; at rest nothing differs. The share is on
// record, and what is played again has the same.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace hybrid {

struct WorldState;

class WorkShare {
 public:
  static constexpr std::uint8_t kMostSteps = 6;

  explicit WorkShare(double period_s) : limit_us_(kOfPeriod * 1e6 * period_s) {}

  // Steps of a quarter of an octave below all of it: what the next tick is to have.
  [[nodiscard]] std::uint8_t steps() const { return steps_; }
  // Of all the work; 1 to a third. (To a quarter, organs were 100 to 151 mN off in place of 91, and ticks no
  // faster than noise.)
  [[nodiscard]] static double share(std::uint8_t steps) noexcept {
    return std::exp2(-0.25 * std::min(steps, kMostSteps));
  }
  // A tick took so long, its own processor time. What is nowhere near tissue says nothing about the work.
  void felt(double tick_us, bool tissue_pressed) noexcept {
    if (tick_us > limit_us_) {
      steps_ = static_cast<std::uint8_t>(
          std::min<int>(kMostSteps, steps_ + (tick_us > kFarBeyond * limit_us_ ? 2 : 1)));
      calm_ = 0;
    } else if (tissue_pressed && tick_us < kCalm * limit_us_ && steps_ > 0 && ++calm_ == kCalmTicks) {
      --steps_;
      calm_ = 0;
    }
  }

 private:
  static constexpr double kOfPeriod = 0.4;   // the rest is for the driver, and for ticks with more to do
  static constexpr double kFarBeyond = 1.5;  // of the limit: then it falls twice as fast
  static constexpr double kCalm = 0.8;       // of the limit: with another step of work it is not beyond it
  static constexpr int kCalmTicks = 60;

  double limit_us_;
  std::uint8_t steps_ = 0;
  int calm_ = 0;
};

// From now on soft objects of `state` that are relaxed apart (async_relaxation.cpp, which knows them) have
// this share of their work at a contact.
void give_work_share(WorldState& state, std::uint8_t steps) noexcept;

}  // namespace hybrid
