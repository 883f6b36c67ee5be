// SPDX-License-Identifier: GPL-3.0-or-later
// The rank test against all permutations, and its approximation against the exact test. The rate of false
// alarms on samples of the same distribution is tested too.
#include "hybrid/bench/reports/rank_test.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <random>
#include <vector>

namespace {

using hybrid::bench::benjamini_hochberg;
using hybrid::bench::least_p;
using hybrid::bench::rank_test;

// Number of pairs in which the value of the second sample is greater, by brute force. A tie counts half.
double pairs(const std::vector<double>& first, const std::vector<double>& second) {
  double u = 0.0;
  for (const double a : first) {
    for (const double b : second) u += b > a ? 1.0 : b == a ? 0.5 : 0.0;
  }
  return u;
}

// p by brute force: of all ways to divide the values into samples of these sizes, the fraction whose u is at
// least as far from the middle.
double p_of_all_permutations(const std::vector<double>& first, const std::vector<double>& second) {
  std::vector<double> values = first;
  values.insert(values.end(), second.begin(), second.end());
  const double middle = 0.5 * static_cast<double>(first.size() * second.size());
  const double off = std::fabs(pairs(first, second) - middle);
  std::size_t all = 0, as_far = 0;
  for (std::uint32_t chosen = 0; chosen < 1U << values.size(); ++chosen) {
    std::vector<double> a, b;
    for (std::size_t i = 0; i < values.size(); ++i) ((chosen >> i & 1U) != 0 ? a : b).push_back(values[i]);
    if (a.size() != first.size()) continue;
    ++all;
    as_far += std::fabs(pairs(a, b) - middle) >= off ? 1 : 0;
  }
  return static_cast<double>(as_far) / static_cast<double>(all);
}

std::vector<double> draw(std::mt19937_64& random, std::size_t count, std::uint64_t kinds) {
  std::vector<double> values(count);
  for (double& value : values) value = static_cast<double>(random() % kinds);
  return values;
}

TEST(RankTest, IsTheShareOfAllPermutationsWithTiesAndWithout) {
  std::mt19937_64 random(7);
  for (std::size_t n = 1; n <= 6; ++n) {
    for (std::size_t m = 1; m <= 6; ++m) {
      for (const std::uint64_t kinds : {std::uint64_t{2}, std::uint64_t{5}, std::uint64_t{1} << 40}) {
        const std::vector<double> a = draw(random, n, kinds), b = draw(random, m, kinds);
        const auto test = rank_test(a, b);
        EXPECT_TRUE(test.exact);
        EXPECT_DOUBLE_EQ(test.u, pairs(a, b)) << n << ", " << m << ", " << kinds;
        EXPECT_NEAR(test.p, p_of_all_permutations(a, b), 1e-12) << n << ", " << m << ", " << kinds;
        EXPECT_NEAR(test.p, rank_test(b, a).p, 1e-12) << "both ways";
      }
    }
  }
}

TEST(RankTest, TheLeastPIsThatOfSamplesThatDoNotOverlap) {
  std::vector<double> low, high;
  for (std::size_t n = 1; n <= 12; ++n) {
    low.push_back(static_cast<double>(n));
    high.push_back(100.0 + static_cast<double>(n));
    EXPECT_NEAR(rank_test(low, high).p, least_p(n, n), 1e-12) << n;
  }
  EXPECT_DOUBLE_EQ(least_p(4, 4), 2.0 / 70.0);
  EXPECT_EQ(hybrid::bench::size_for(0.05), 4U);  // with 3 values each, p is at least 0.1
  EXPECT_GT(least_p(3, 3), 0.05);
  for (const double p : {0.01, 1e-3, 1e-6}) {
    const std::size_t size = hybrid::bench::size_for(p);
    EXPECT_LE(least_p(size, size), p);
    EXPECT_GT(least_p(size - 1, size - 1), p);
  }
}

TEST(RankTest, TheApproximationIsNearTheExactTest) {
  std::mt19937_64 random(11);
  for (const std::uint64_t kinds : {std::uint64_t{8}, std::uint64_t{1} << 40}) {
    for (int i = 0; i < 50; ++i) {
      const std::vector<double> a = draw(random, 15, kinds), b = draw(random, 15, kinds);
      EXPECT_NEAR(rank_test(a, b).p, hybrid::bench::normal_p(a, b), 0.02);
    }
  }
  const std::vector<double> a = draw(random, 40, 1U << 20), b = draw(random, 40, 1U << 20);
  EXPECT_FALSE(rank_test(a, b).exact);
}

TEST(RankTest, NothingIsToldFromNothingOrFromTheSame) {
  const std::vector<double> none, ones(5, 1.0), many(50, 1.0);
  EXPECT_EQ(rank_test(none, ones).p, 1.0);
  EXPECT_EQ(rank_test(ones, ones).p, 1.0);
  EXPECT_EQ(rank_test(many, many).p, 1.0);
}

// The definition: with sorted p, find the greatest k with p(k) <= rate · k / m. The first k figures are
// called different.
TEST(RankTest, BenjaminiHochbergIsItsDefinition) {
  std::mt19937_64 random(13);
  for (int i = 0; i < 200; ++i) {
    std::vector<double> p(1 + random() % 12);
    for (double& value : p) value = static_cast<double>(random() % 1000) / (random() % 2 == 0 ? 1e3 : 2e4);
    const std::vector<double> adjusted = benjamini_hochberg(p);
    std::vector<double> sorted = p;
    std::sort(sorted.begin(), sorted.end());
    for (const double rate : {0.0123, 0.0507, 0.2011}) {
      double most = -1.0;
      for (std::size_t k = 1; k <= sorted.size(); ++k) {
        const double allowed = rate * static_cast<double>(k) / static_cast<double>(sorted.size());
        if (sorted[k - 1] <= allowed) most = sorted[k - 1];
      }
      for (std::size_t f = 0; f < p.size(); ++f)
        EXPECT_EQ(adjusted[f] <= rate, p[f] <= most) << p[f] << " at " << rate;
    }
  }
}

TEST(RankTest, QuartilesOfKnownSamples) {
  const auto five = hybrid::bench::quartiles_of({5.0, 1.0, 4.0, 2.0, 3.0});
  EXPECT_EQ(five.q1, 2.0);
  EXPECT_EQ(five.median, 3.0);
  EXPECT_EQ(five.q3, 4.0);
  const auto two = hybrid::bench::quartiles_of({2.0, 1.0});
  EXPECT_DOUBLE_EQ(two.median, 1.5);
  const double never = HUGE_VAL;
  EXPECT_EQ(hybrid::bench::quartiles_of({1.0, never, never}).median, never);
  EXPECT_EQ(hybrid::bench::quartiles_of({1.0, 2.0, never}).median, 2.0);
}

constexpr int kComparisons = 2000;
// Fraction of comparisons of equal distributions in which at least one figure is called different. `common`
// is the fraction of a run's noise that all its figures share.
double called_changed(std::size_t runs, std::size_t figures, double common) {
  std::mt19937_64 random(17);
  std::map<double, double> known;  // [u] p, which depends on u alone if no values tie
  std::normal_distribution<double> noise;
  int called = 0;
  for (int comparison = 0; comparison < kComparisons; ++comparison) {
    std::vector<double> of_run(2 * runs);
    for (double& value : of_run) value = noise(random);
    std::vector<double> p;
    for (std::size_t figure = 0; figure < figures; ++figure) {
      std::vector<double> values(2 * runs);
      for (std::size_t run = 0; run < values.size(); ++run)
        values[run] = std::exp(common * of_run[run] + (1.0 - common) * noise(random));
      const std::vector<double> first(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(runs)),
          second(values.begin() + static_cast<std::ptrdiff_t>(runs), values.end());
      const auto [found, is_new] = known.try_emplace(pairs(first, second));
      if (is_new) found->second = rank_test(first, second).p;
      p.push_back(found->second);
    }
    const std::vector<double> rates = benjamini_hochberg(p);
    called += *std::min_element(rates.begin(), rates.end()) <= 0.05 ? 1 : 0;
  }
  return static_cast<double>(called) / kComparisons;
}

TEST(RankTest, EqualDistributionsAreToldApartInAtMostFiveOfAHundred) {
  // If the true rate is exactly 5 %, one simulation in a thousand exceeds `most` by chance.
  const double most = 0.05 + 3.1 * std::sqrt(0.05 * 0.95 / kComparisons);
  for (const std::size_t runs : {std::size_t{4}, std::size_t{5}, std::size_t{9}}) {
    for (const double common : {0.0, 0.5, 0.9, 1.0}) {
      const double share = called_changed(runs, 100, common);
      EXPECT_LE(share, most) << runs << " runs, common " << common;
    }
  }
}

}  // namespace
