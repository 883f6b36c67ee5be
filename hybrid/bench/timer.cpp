// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/bench/timer.h"

#include <algorithm>
#include <array>

namespace hybrid::bench {

TickTimer::TickTimer() {
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  const std::uint64_t first = begin();
  auto now = Clock::now();
  while (now - start < std::chrono::milliseconds(20)) now = Clock::now();
  us_per_count_ = std::chrono::duration<double, std::micro>(now - start).count() /
                  static_cast<double>(std::max<std::uint64_t>(1, end() - first));
  std::array<std::uint64_t, 1001> empty{};
  for (std::uint64_t& counts : empty) {
    const std::uint64_t before = begin();
    counts = end() - before;
  }
  std::nth_element(empty.begin(), empty.begin() + empty.size() / 2, empty.end());
  overhead_us_ = us(empty[empty.size() / 2]);
}

}  // namespace hybrid::bench
