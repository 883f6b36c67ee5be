// SPDX-License-Identifier: GPL-3.0-or-later
// CPU time of the calling thread.
#pragma once

#include <pthread.h>
#include <time.h>

namespace hybrid {

// CPU time since the thread began (s). Time in which it was pre-empted does not count.
[[nodiscard]] inline double thread_time_s() noexcept {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

// The same of another thread; 0 if it has ended.
[[nodiscard]] inline double thread_time_s(pthread_t thread) noexcept {
  clockid_t clock{};
  timespec now{};
  if (pthread_getcpuclockid(thread, &clock) != 0 || clock_gettime(clock, &now) != 0) return 0.0;
  return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

}  // namespace hybrid
