// SPDX-License-Identifier: GPL-3.0-or-later
// A clock for pieces of work of a few dozen nanoseconds: the processor's time stamp counter. It is fenced, so
// that no part of the work runs outside the two readings. On other processors than x86 it is the steady
// clock.
#pragma once

#include <chrono>
#include <cstdint>
#if defined(__x86_64__)
#include <x86intrin.h>
#endif

namespace hybrid::bench {

class TickTimer {
 public:
  TickTimer();  // takes 20 ms, to find the counter's rate and the time of an empty measurement

#if defined(__x86_64__)
  static std::uint64_t begin() noexcept {
    _mm_lfence();
    const std::uint64_t now = __rdtsc();
    _mm_lfence();
    return now;
  }
  static std::uint64_t end() noexcept {
    unsigned int processor = 0;
    const std::uint64_t now = __rdtscp(&processor);
    _mm_lfence();
    return now;
  }
#else
  static std::uint64_t begin() noexcept {
    return static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count());
  }
  static std::uint64_t end() noexcept {
    return begin();
  }
#endif

  [[nodiscard]] double us(std::uint64_t counts) const noexcept {
    return static_cast<double>(counts) * us_per_count_;
  }
  // The median of empty measurements. It is part of every measured time and is never subtracted.
  [[nodiscard]] double overhead_us() const noexcept {
    return overhead_us_;
  }

 private:
  double us_per_count_ = 0.0, overhead_us_ = 0.0;
};

}  // namespace hybrid::bench
