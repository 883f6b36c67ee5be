// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/loop/servo_timer.h"

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <ctime>
#include <stdexcept>

namespace device {
namespace {

constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;
constexpr int kServoPriority = 80;  // above interrupt threads (50), below the kernel's own (99)

std::int64_t now_ns() noexcept {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * kNanosecondsPerSecond + now.tv_nsec;
}

std::string lock_memory() {
  // With MCL_FUTURE and a finite limit, later allocations could fail. So future pages are locked only if
  // there is no limit. A privileged process may remove the limit.
  rlimit unlimited{RLIM_INFINITY, RLIM_INFINITY};
  rlimit limit{};
  const bool no_limit = setrlimit(RLIMIT_MEMLOCK, &unlimited) == 0 ||
                        (getrlimit(RLIMIT_MEMLOCK, &limit) == 0 && limit.rlim_cur == RLIM_INFINITY);
  if (mlockall(no_limit ? MCL_CURRENT | MCL_FUTURE : MCL_CURRENT) == 0) {
    if (no_limit) return "Memory is locked.";
    return "Memory in use now is locked; later memory is not, because there is a limit on it. "
           "To lock it all, add '* - memlock unlimited' to /etc/security/limits.conf and log in again.";
  }
  return std::string("Memory is not locked (") + std::strerror(errno) +
         "), so a page fault may delay a tick. To allow it, add '* - memlock unlimited' to "
         "/etc/security/limits.conf and log in again.";
}

std::string take_servo_priority() {
  sched_param parameters{};
  parameters.sched_priority = kServoPriority;
  int failed = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
  rlimit limit{};
  if (failed == EPERM && getrlimit(RLIMIT_RTPRIO, &limit) == 0 && limit.rlim_cur > 0) {
    // The user may be allowed only a lower real-time priority.
    parameters.sched_priority = static_cast<int>(std::min<rlim_t>(limit.rlim_cur, kServoPriority));
    failed = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
  }
  if (failed == 0) {
    return "The servo thread runs at real-time priority " + std::to_string(parameters.sched_priority) +
           " (SCHED_FIFO). ";
  }
  return std::string("Real-time priority was not granted (") + std::strerror(failed) +
         "), so ticks may be late by milliseconds. To allow it, add '* - rtprio 80' to "
         "/etc/security/limits.conf and log in again, or run with the capability CAP_SYS_NICE. ";
}

}  // namespace

ServoTimer::ServoTimer(double period_s) {
  if (!(period_s >= 1e-6 && period_s <= 60.0)) {
    throw std::invalid_argument("servo period " + std::to_string(period_s) +
                                " s: choose one between 1 microsecond and 1 minute (0.001 is 1 kHz)");
  }
  period_ns_ = std::llround(period_s * 1e9);
}

std::string ServoTimer::raise_priority() {
  // Memory is locked first, so that its pages are loaded before the thread can starve others.
  const std::string memory = lock_memory();
  return take_servo_priority() + memory;
}

double ServoTimer::wait() noexcept {
  if (next_ns_ == 0) next_ns_ = now_ns();
  next_ns_ += period_ns_;
  const timespec wake{next_ns_ / kNanosecondsPerSecond, next_ns_ % kNanosecondsPerSecond};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &wake, nullptr) == EINTR) {
  }
  const std::int64_t late_ns = std::max<std::int64_t>(0, now_ns() - next_ns_);
  const std::int64_t skipped = late_ns / period_ns_;
  missed_ += static_cast<std::uint64_t>(skipped);
  next_ns_ += skipped * period_ns_;
  return static_cast<double>(late_ns) * 1e-9;
}

}  // namespace device
