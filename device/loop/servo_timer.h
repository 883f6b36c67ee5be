// SPDX-License-Identifier: GPL-3.0-or-later
// Paces a loop at a fixed rate on the monotonic clock, and reports the delay of each wake-up.
#pragma once

#include <cstdint>
#include <string>

namespace device {

class ServoTimer {
 public:
  explicit ServoTimer(double period_s);
  // Requests SCHED_FIFO for the calling thread, and locked memory. Returns a text that says which requests
  // were granted.
  std::string raise_priority();
  // Sleeps until the next period begins. Returns the delay of the wake-up (s). Periods that were missed
  // entirely are counted and skipped; their ticks do not follow in a burst.
  double wait() noexcept;
  [[nodiscard]] std::uint64_t missed() const noexcept { return missed_; }

 private:
  std::int64_t period_ns_;
  std::int64_t next_ns_ = 0;
  std::uint64_t missed_ = 0;
};

}  // namespace device
