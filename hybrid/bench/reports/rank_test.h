// SPDX-License-Identifier: GPL-3.0-or-later
// Do two samples differ? The Mann-Whitney U test, and the Benjamini-Hochberg procedure for many tests.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace hybrid::bench {

struct RankTest {
  double u = 0.0;  // pairs in which the value of the second sample is greater; a tie counts half
  double p = 1.0;  // two-sided
  // True: over all ways to divide the values between the samples; false: normal approximation.
  bool exact = true;
};
// The test is exact if both samples together have at most this many values. Ties are allowed.
inline constexpr std::size_t kMostExactValues = 30;
// Empty samples give p = 1. No value may be NaN.
RankTest rank_test(std::span<const double> first, std::span<const double> second);
// The normal approximation, corrected for ties and continuity. p = 1 if all values are equal.
double normal_p(std::span<const double> first, std::span<const double> second);

// The least p that two samples of these sizes can have. It occurs if their ranges do not overlap.
double least_p(std::size_t first, std::size_t second);
// The least size of both samples at which least_p() is `p` or less.
std::size_t size_for(double p);

// For each p, the least false discovery rate at which the procedure rejects the hypothesis of that p.
std::vector<double> benjamini_hochberg(std::span<const double> p);

struct Quartiles {
  double q1 = 0.0, median = 0.0, q3 = 0.0;
};
// Linear interpolation between the sorted values. The last values may be infinite. `values` must not be
// empty.
Quartiles quartiles_of(std::vector<double> values);

}  // namespace hybrid::bench
