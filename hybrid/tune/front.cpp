// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tune/front.h"

#include <algorithm>
#include <stdexcept>

namespace hybrid {
namespace {

bool dominates(const CostAndError& a, const CostAndError& b, double margin) {
  const double factor = 1.0 + margin;
  if (!(factor * a.cost_us <= b.cost_us && factor * a.error_jnd <= b.error_jnd)) return false;
  return a.cost_us < b.cost_us || a.error_jnd < b.error_jnd;
}

bool equal(const CostAndError& a, const CostAndError& b) {
  return a.cost_us == b.cost_us && a.error_jnd == b.error_jnd;
}

// Index of the best point, by `less`, of those that `pass` accepts; empty if it accepts none.
template <typename Pass, typename Less>
std::optional<std::size_t> best(std::span<const CostAndError> points, const Pass& pass, const Less& less) {
  std::optional<std::size_t> found;
  for (std::size_t n = 0; n < points.size(); ++n) {
    if (pass(n) && (!found || less(points[n], points[*found]))) found = n;
  }
  return found;
}

bool cheaper(const CostAndError& a, const CostAndError& b) {
  return a.cost_us != b.cost_us ? a.cost_us < b.cost_us : a.error_jnd < b.error_jnd;
}
bool more_accurate(const CostAndError& a, const CostAndError& b) {
  return a.error_jnd != b.error_jnd ? a.error_jnd < b.error_jnd : a.cost_us < b.cost_us;
}

}  // namespace

std::optional<std::size_t> dominated_by(std::span<const CostAndError> points, std::size_t point,
                                        double margin) {
  for (std::size_t n = 0; n < points.size(); ++n) {
    if (n == point || (points[point].sound && !points[n].sound)) continue;
    if (dominates(points[n], points[point], margin)) return n;
    if (margin == 0.0 && n < point && equal(points[n], points[point])) return n;
  }
  return std::nullopt;
}

std::vector<std::size_t> pareto_front(std::span<const CostAndError> points) {
  std::vector<std::size_t> front;
  for (std::size_t n = 0; n < points.size(); ++n) {
    if (!dominated_by(points, n)) front.push_back(n);
  }
  std::ranges::sort(front, [&](std::size_t a, std::size_t b) { return cheaper(points[a], points[b]); });
  return front;
}

Choice choose_setting(std::span<const CostAndError> points, const Bounds& bounds) {
  if (points.empty()) throw std::invalid_argument("choose_setting: no settings");
  Choice choice;
  choice.any_sound = std::ranges::any_of(points, &CostAndError::sound);
  const auto sound = [&](std::size_t n) { return points[n].sound || !choice.any_sound; };
  const auto accurate = [&](std::size_t n) { return sound(n) && points[n].error_jnd < bounds.error_jnd; };
  const auto in_time = [&](std::size_t n) { return sound(n) && points[n].cost_us <= bounds.budget_us; };
  const auto both = [&](std::size_t n) { return accurate(n) && in_time(n); };
  if (const auto cheapest = best(points, both, cheaper)) {
    choice.chosen = *cheapest;
  } else if (const auto finest = best(points, in_time, more_accurate)) {
    choice.chosen = *finest;
    choice.rule = ChoiceRule::most_accurate_in_time;
  } else {
    choice.chosen = *best(points, sound, cheaper);
    choice.rule = ChoiceRule::cheapest;
  }
  const auto other = [&](std::size_t n) { return n != choice.chosen && accurate(n); };
  choice.next_accurate = best(points, other, cheaper);
  return choice;
}

}  // namespace hybrid
