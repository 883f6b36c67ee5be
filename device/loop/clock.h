// SPDX-License-Identifier: GPL-3.0-or-later
// Simulated time as a compensated sum of many steps.
#pragma once

namespace device {

// Compensated summation (Knuth, The Art of Computer Programming, vol. 2, 4.2.2): the rounding error of each
// addition is carried into the next one. So for any n the time after n steps is n·dt, rounded once. A plain
// sum would drift by microseconds within hours.
class Clock {
 public:
  Clock() = default;
  explicit Clock(double start_s) noexcept : sum_s_(start_s) {}

  void add(double dt_s) noexcept {
    const double step = dt_s + rest_s_, sum = sum_s_ + step, part = sum - sum_s_;
    rest_s_ = (sum_s_ - (sum - part)) + (step - part);
    sum_s_ = sum;
  }
  [[nodiscard]] double now_s() const noexcept { return sum_s_; }

 private:
  double sum_s_ = 0.0, rest_s_ = 0.0;
};

}  // namespace device
