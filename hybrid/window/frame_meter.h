// SPDX-License-Identifier: GPL-3.0-or-later
// Measures the time and the processor time of frames, and the session's share of both. Processor time does
// not depend on the load of the machine.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace hybrid {

class FrameMeter {
 public:
  // The first frames are not counted, because the driver compiles shaders during them.
  static constexpr std::uint64_t kWarmUp = 5;

  // Call at the beginning and at the end of each frame. `session_s`: processor time of the session so far, on
  // whatever threads it runs.
  void begin(double session_s);
  void end(double session_s);

  // "120 frames: 30.1 frames/s; a frame takes …", or the reason why there are no figures.
  [[nodiscard]] std::string in_words() const;

 private:
  std::uint64_t frames_ = 0;  // with those that are not counted
  std::chrono::steady_clock::time_point start_{};
  double cpu_start_s_ = 0.0, session_start_s_ = 0.0;
  double time_s_ = 0.0, cpu_s_ = 0.0, session_s_ = 0.0;  // sums over the frames that count
};

}  // namespace hybrid
