// SPDX-License-Identifier: GPL-3.0-or-later
// Compares the Pareto front and the choice with their definitions, on random points.
#include "hybrid/tune/front.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace {

using hybrid::ChoiceRule;
using hybrid::CostAndError;

// Few distinct values, so that ties are common.
std::vector<CostAndError> random_points(std::mt19937& random) {
  std::uniform_int_distribution<int> count(1, 30), value(1, 12), fault(0, 5);
  std::vector<CostAndError> points(static_cast<std::size_t>(count(random)));
  for (CostAndError& p : points) p = {50.0 * value(random), 0.25 * value(random), fault(random) > 0};
  return points;
}

bool beats(const CostAndError& a, const CostAndError& b) {
  return a.cost_us <= b.cost_us && a.error_jnd <= b.error_jnd &&
         (a.cost_us < b.cost_us || a.error_jnd < b.error_jnd) && (a.sound || !b.sound);
}

TEST(TuneFront, HasExactlyThePointsThatNoOtherBeats) {
  std::mt19937 random(1);
  for (int round = 0; round < 2000; ++round) {
    const auto points = random_points(random);
    const auto front = hybrid::pareto_front(points);
    for (std::size_t n = 0; n < points.size(); ++n) {
      const bool beaten = std::ranges::any_of(points, [&](const auto& p) { return beats(p, points[n]); });
      const bool on_front = std::ranges::find(front, n) != front.end();
      if (beaten) {
        EXPECT_FALSE(on_front);
        continue;
      }
      // The point itself or an equal one is on the front.
      EXPECT_TRUE(std::ranges::any_of(front, [&](std::size_t f) {
        return points[f].cost_us == points[n].cost_us && points[f].error_jnd == points[n].error_jnd;
      }));
    }
    EXPECT_TRUE(std::ranges::is_sorted(
        front, [&](std::size_t a, std::size_t b) { return points[a].cost_us < points[b].cost_us; }));
  }
}

TEST(TuneFront, AMarginLeavesOnlyWhatIsClearlyBeaten) {
  const std::vector<CostAndError> points{{100, 1.0}, {109, 1.09}, {120, 1.2}, {120, 0.9}};
  EXPECT_FALSE(hybrid::dominated_by(points, 1, 0.1));
  EXPECT_EQ(hybrid::dominated_by(points, 2, 0.1), 0U);
  EXPECT_FALSE(hybrid::dominated_by(points, 3, 0.0));
}

TEST(TuneChoice, FollowsItsRules) {
  std::mt19937 random(2);
  const hybrid::Bounds bounds{.error_jnd = 1.0, .budget_us = 300.0};
  int seen[3] = {0, 0, 0};
  for (int round = 0; round < 2000; ++round) {
    const auto points = random_points(random);
    const auto choice = hybrid::choose_setting(points, bounds);
    const bool any_sound = std::ranges::any_of(points, &CostAndError::sound);
    const auto counts = [&](const CostAndError& p) { return p.sound || !any_sound; };
    const auto in_time = [&](const CostAndError& p) { return counts(p) && p.cost_us <= bounds.budget_us; };
    const auto good = [&](const CostAndError& p) { return in_time(p) && p.error_jnd < bounds.error_jnd; };
    const CostAndError& chosen = points[choice.chosen];
    ++seen[static_cast<int>(choice.rule)];
    EXPECT_TRUE(counts(chosen));
    for (const CostAndError& p : points) {
      if (std::ranges::any_of(points, good)) {
        EXPECT_EQ(choice.rule, ChoiceRule::cheapest_accurate);
        EXPECT_TRUE(good(chosen));
        if (good(p)) {
          EXPECT_LE(chosen.cost_us, p.cost_us);
        }
      } else if (std::ranges::any_of(points, in_time)) {
        EXPECT_EQ(choice.rule, ChoiceRule::most_accurate_in_time);
        EXPECT_TRUE(in_time(chosen));
        if (in_time(p)) {
          EXPECT_LE(chosen.error_jnd, p.error_jnd);
        }
      } else {
        EXPECT_EQ(choice.rule, ChoiceRule::cheapest);
        if (counts(p)) {
          EXPECT_LE(chosen.cost_us, p.cost_us);
        }
      }
    }
  }
  for (const int count : seen) EXPECT_GT(count, 10);
  EXPECT_THROW((void)hybrid::choose_setting({}, bounds), std::invalid_argument);
}

}  // namespace
