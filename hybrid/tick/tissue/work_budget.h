// SPDX-License-Identifier: GPL-3.0-or-later
// In real time a tick does only a share of its counted work at a contact, so that ticks are not late on a
// slow machine.
//
// Work is counted, never timed, so that the same inputs give the same bits; only the time that it takes
// depends on the machine. In real time the share follows the measured duration of ticks. With a smaller share
// a moving contact comes to rest some ticks later. The force at rest is the same. The share is recorded, and
// a replayed session uses the recorded one.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace hybrid {

struct WorldState;

class WorkShare {
 public:
  static constexpr std::uint8_t kMostSteps = 6;  // steps below the whole work; six are a factor of 0.35

  explicit WorkShare(double period_s) : limit_us_(kShareOfPeriod * 1e6 * period_s) {}

  // The share that the next tick gets, as a number of steps below the whole work. A step is a factor of
  // 2^(1/4).
  [[nodiscard]] std::uint8_t steps() const { return steps_; }
  // The share as a fraction of the whole work: from 1 down to 0.35.
  [[nodiscard]] static double share(std::uint8_t steps) noexcept {
    return std::exp2(-0.25 * std::min(steps, kMostSteps));
  }
  // Call it with the CPU time of a tick. Ticks without pressed tissue say nothing about the work and never
  // raise the share.
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
  static constexpr double kFarBeyond = 1.5;      // unit: the limit; beyond this the share falls twice as fast
  static constexpr double kFastTick = 0.8;  // unit: the limit; below this one more step of work still fits
  static constexpr int kFastTicks = 60;     // fast ticks after which the share rises by a step

  double limit_us_;
  std::uint8_t steps_ = 0;
  int fast_ticks_ = 0;
};

// Sets the share of work at a contact for the soft objects of `state` under asynchronous relaxation.
void give_work_share(WorldState& state, std::uint8_t steps) noexcept;

}  // namespace hybrid
