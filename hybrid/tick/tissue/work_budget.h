// SPDX-License-Identifier: GPL-3.0-or-later
// The share of its counted work that a tick in real time does at a contact, so that ticks are not late on a
// slow machine.
//
// Work is counted, never timed, so that the same inputs give the same bits; only the time that it takes
// depends on the machine. In real time the share follows the measured duration of ticks. With a smaller share
// a moving contact comes to rest some ticks later; at rest nothing differs. The share is recorded, and a
// replayed session uses the recorded one.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace hybrid {

struct WorldState;

class WorkShare {
 public:
  static constexpr std::uint8_t kMostSteps = 6;

  explicit WorkShare(double period_s) : limit_us_(kShareOfPeriod * 1e6 * period_s) {}

  // The share that the next tick is to have, in steps of a quarter of an octave below all of the work.
  [[nodiscard]] std::uint8_t steps() const { return steps_; }
  // Fraction of all the work: 1 down to a third.
  [[nodiscard]] static double share(std::uint8_t steps) noexcept {
    return std::exp2(-0.25 * std::min(steps, kMostSteps));
  }
  // Call with a tick's own CPU time. Ticks without pressed tissue say nothing about the work and never raise
  // the share.
  void observe(double tick_us, bool tissue_pressed) noexcept {
    if (tick_us > limit_us_) {
      steps_ = static_cast<std::uint8_t>(
          std::min<int>(kMostSteps, steps_ + (tick_us > kFarBeyond * limit_us_ ? 2 : 1)));
      fast_ticks_ = 0;
    } else if (tissue_pressed && tick_us < kFastTick * limit_us_ && steps_ > 0 &&
               ++fast_ticks_ == kFastTicks) {
      --steps_;
      fast_ticks_ = 0;
    }
  }

 private:
  static constexpr double kShareOfPeriod = 0.4;  // the rest is for the driver, and for ticks with more to do
  static constexpr double kFarBeyond = 1.5;      // of the limit: the share then falls twice as fast
  static constexpr double kFastTick = 0.8;  // of the limit: one more step of work still stays below the limit
  static constexpr int kFastTicks = 60;

  double limit_us_;
  std::uint8_t steps_ = 0;
  int fast_ticks_ = 0;
};

// Sets the share of work at a contact for the soft objects of `state` under asynchronous relaxation.
void give_work_share(WorldState& state, std::uint8_t steps) noexcept;

}  // namespace hybrid
