// SPDX-License-Identifier: GPL-3.0-or-later
// Paces a loop at a fixed rate on the monotonic clock, and says how late the machine made it.
#pragma once

#include <cstdint>
#include <string>

namespace device {

class ServoTimer {
 public:
  explicit ServoTimer(double period_s);
  // Asks for SCHED_FIFO and locked memory for the calling thread; says in words what was and was not granted.
  std::string raise_priority();
  // Sleeps until the next period begins; returns how late this thread woke (unit: second). After a wake later
  // than a whole period the missed periods are counted and skipped, not made up in a burst.
  double wait() noexcept;
  [[nodiscard]] std::uint64_t missed() const noexcept { return missed_; }

 private:
  std::int64_t period_ns_;
  std::int64_t next_ns_ = 0;
  std::uint64_t missed_ = 0;
};

}  // namespace device
