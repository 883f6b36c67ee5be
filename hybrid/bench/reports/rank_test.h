// SPDX-License-Identifier: GPL-3.0-or-later
// Whether two samples differ: the Mann-Whitney U test, and the Benjamini-Hochberg procedure over many tests.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace hybrid::bench {

struct RankTest {
  double u = 0.0;     // pairs in which the second value is greater; a tie counts half
  double p = 1.0;     // two-sided
  bool exact = true;  // over all ways to deal the values to the two samples; else the normal approximation
};
// Up to so many values in both samples together the test is exact, with ties too.
inline constexpr std::size_t kMostExactValues = 30;
// Empty samples give p = 1. No value may be NaN.
RankTest rank_test(std::span<const double> first, std::span<const double> second);
// The normal approximation, corrected for ties and continuity. p = 1 if all values are equal.
double normal_p(std::span<const double> first, std::span<const double> second);

// The least p that two samples of these sizes can have: when they do not overlap.
double least_p(std::size_t first, std::size_t second);
// The least size of both samples whose least p is `p` or below.
std::size_t size_for(double p);

// For each p the least rate of false discoveries at which the procedure rejects it.
std::vector<double> benjamini_hochberg(std::span<const double> p);

struct Quartiles {
  double q1 = 0.0, median = 0.0, q3 = 0.0;
};
// Linear between the sorted values, the last of which may be infinite. `values` must not be empty.
Quartiles quartiles_of(std::vector<double> values);

}  // namespace hybrid::bench
