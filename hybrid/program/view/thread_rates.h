// SPDX-License-Identifier: GPL-3.0-or-later
// How often each thread of a live window does its work, for the panel.
#pragma once

#include <chrono>
#include <cstdint>
#include <vector>

#include "hybrid/window/panels.h"

namespace hybrid {

// Counted since the session began in its present scene; processor times in seconds.
struct ThreadCounts {
  std::uint64_t ticks = 0, answers_at_rest = 0;
  double servo_s = 0.0, relaxation_s = 0.0;
  bool has_tissue = false, compares_with_rest = false;
};

class ThreadRates {
 public:
  // Call once a frame.
  void add(const ThreadCounts& now);
  // The rates of the last half second.
  [[nodiscard]] const std::vector<ThreadRate>& rates() const { return rates_; }

 private:
  ThreadCounts then_;
  std::uint64_t frames_ = 0;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  std::vector<ThreadRate> rates_;
};

}  // namespace hybrid
