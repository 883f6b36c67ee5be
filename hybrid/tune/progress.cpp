// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tune/progress.h"

#include <fmt/format.h>

#include <algorithm>

namespace hybrid {
namespace {

constexpr double kFromCache_s = 0.02;  // a shorter step came from the cache

std::string time_in_words(double seconds) {
  return seconds < 90.0 ? fmt::format("{:.0f} s", seconds) : fmt::format("{:.0f} min", seconds / 60.0);
}

}  // namespace

double SearchProgress::seconds() const {
  return std::chrono::duration<double>(Clock::now() - begin_).count();
}

void SearchProgress::say(const std::string& words, double now_s, double weight) {
  if (!say_) return;
  std::string text =
      fmt::format("{:.0f} %", 100.0 * std::min(done_ / std::max(planned_, done_ + weight), 1.0));
  if (worked_ > 0.0) {
    const double left_s = worked_s_ / worked_ * std::max(planned_ - done_, weight) - now_s;
    text += fmt::format(", about {} left", time_in_words(std::max(left_s, 1.0)));
  }
  say_(fmt::format("{}: {}", text, words));
}

void SearchProgress::step(const std::string& words, double weight,
                          const std::function<void(const Progress&)>& work) {
  const Clock::time_point begin = Clock::now();
  const auto now_s = [begin] { return std::chrono::duration<double>(Clock::now() - begin).count(); };
  say(words, 0.0, weight);
  work([&](const std::string& inner) { say(words + ": " + inner, now_s(), weight); });
  done_ += weight;
  if (now_s() < kFromCache_s) return;
  worked_ += weight;
  worked_s_ += now_s();
}

}  // namespace hybrid
