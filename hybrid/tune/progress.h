// SPDX-License-Identifier: GPL-3.0-or-later
// Progress of a search as a share and a time left, from weights of its steps.
#pragma once

#include <chrono>
#include <string>

#include "hybrid/build/build_world.h"
#include "hybrid/tune/truth.h"

namespace hybrid {

class SearchProgress {
 public:
  explicit SearchProgress(Progress say) : say_(std::move(say)) {}

  // More, or less, is to be done than was planned.
  void plan(double weight) { planned_ += weight; }
  // Does the work and says its progress.
  void step(const std::string& words, double weight, const std::function<void(const Progress&)>& work);
  [[nodiscard]] Step as_step() {
    return [this](const std::string& words, double weight, const std::function<void(const Progress&)>& work) {
      step(words, weight, work);
    };
  }
  [[nodiscard]] double seconds() const;

 private:
  using Clock = std::chrono::steady_clock;
  void say(const std::string& words, double now_s, double weight);

  Progress say_;
  Clock::time_point begin_ = Clock::now();
  double planned_ = 0.0, done_ = 0.0;
  double worked_ = 0.0, worked_s_ = 0.0;  // weight and time of steps that were not from a cache
};

}  // namespace hybrid
