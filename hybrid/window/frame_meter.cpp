// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/window/frame_meter.h"

#include <fmt/format.h>

#include <ctime>

namespace hybrid {
namespace {

// Of the whole process.
double processor_time_s() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace

void FrameMeter::begin(double session_s) {
  start_ = std::chrono::steady_clock::now();
  cpu_start_s_ = processor_time_s();
  session_start_s_ = session_s;
}

void FrameMeter::end(double session_s) {
  if (++frames_ <= kWarmUp) return;
  time_s_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  cpu_s_ += processor_time_s() - cpu_start_s_;
  session_s_ += session_s - session_start_s_;
}

std::string FrameMeter::in_words() const {
  if (frames_ <= kWarmUp) return fmt::format("the cost of a frame is known from {} frames on", kWarmUp + 1);
  const auto counted = static_cast<double>(frames_ - kWarmUp);
  return fmt::format(
      "{:.1f} frames/s; a frame takes {:.1f} ms, and {:.1f} ms of processor time: {:.1f} ms for the session, "
      "{:.1f} ms for the window",
      counted / time_s_, 1e3 * time_s_ / counted, 1e3 * cpu_s_ / counted, 1e3 * session_s_ / counted,
      1e3 * (cpu_s_ - session_s_) / counted);
}

}  // namespace hybrid
