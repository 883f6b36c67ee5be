// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/program/view/thread_rates.h"

#include <algorithm>

namespace hybrid {
namespace {

constexpr double kOver_s = 0.5;  // time over which rates are counted

}  // namespace

// A count that fell belongs to a new session or to a new thread, and counts from zero.
void ThreadRates::add(const ThreadCounts& now) {
  ++frames_;
  const auto end = std::chrono::steady_clock::now();
  const double over_s = std::chrono::duration<double>(end - begin_).count();
  if (over_s < kOver_s) return;
  const auto share = [over_s](auto value, auto before) {
    const auto passed = static_cast<double>(value < before ? value : value - before);
    return std::max(passed, 0.0) / over_s;
  };
  rates_ = {{"haptic ticks", share(now.ticks, then_.ticks), share(now.servo_s, then_.servo_s)}};
  if (now.has_tissue) rates_.push_back({"relaxation", -1.0, share(now.relaxation_s, then_.relaxation_s)});
  if (now.compares_with_rest)
    rates_.push_back({"forces at rest", share(now.answers_at_rest, then_.answers_at_rest), -1.0});
  rates_.push_back({"frames", static_cast<double>(frames_) / over_s, -1.0});
  then_ = now;
  frames_ = 0;
  begin_ = end;
}

}  // namespace hybrid
