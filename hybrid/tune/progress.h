// SPDX-License-Identifier: GPL-3.0-or-later
// Progress of a search: the done share and the time left, from the weights of its steps.
#pragma once

#include <chrono>
#include <string>

#include "hybrid/build/build_world.h"
#include "hybrid/tune/truth.h"

namespace hybrid {

class SearchProgress {
 public:
  explicit SearchProgress(Progress say) : say_(std::move(say)) {}

  // Changes the planned work by this weight; negative: less work.
  void plan(double weight) { planned_ += weight; }
  // Does the work of a step and reports its progress.
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
  double worked_ = 0.0, worked_s_ = 0.0;  // weight and time of the steps that did not come from the cache
};

}  // namespace hybrid
