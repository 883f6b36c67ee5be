// SPDX-License-Identifier: GPL-3.0-or-later
// Decides when the force is at rest under a device that stands still.
#pragma once

#include <array>
#include <cstddef>
#include <glm/vec3.hpp>

#include "hybrid/feel/just_noticeable.h"

namespace hybrid {

class RestWatch {
 public:
  // At rest: the force changes by less than kAtRest_jnd within kTicks ticks. A lag that falls with the root
  // of time is then below 0.4 JND after 0.1 s.
  static constexpr double kAtRest_jnd = 0.02;
  static constexpr std::size_t kTicks = 10;

  // `floor_N`: lower bound of the JND.
  explicit RestWatch(double floor_N) noexcept : floor_N_(floor_N) {}

  [[nodiscard]] bool at_rest() const noexcept { return at_rest_; }
  // Call it after each tick with the device still.
  void see(const glm::dvec3& force_N) noexcept {
    glm::dvec3& earlier_N = last_N_[seen_ % kTicks];
    if (seen_ >= kTicks && jnd_of(earlier_N, force_N, floor_N_) < kAtRest_jnd) at_rest_ = true;
    earlier_N = force_N;
    ++seen_;
  }
  // Call it when the device has moved.
  void begin_anew() noexcept {
    at_rest_ = false;
    seen_ = 0;
  }

 private:
  double floor_N_;
  bool at_rest_ = false;
  std::size_t seen_ = 0;
  std::array<glm::dvec3, kTicks> last_N_{};
};

}  // namespace hybrid
