// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/bench/reports/rank_test.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace hybrid::bench {
namespace {

// Twice the mean ranks of the values of both samples; the first sample comes first. Twice a mean rank is a
// whole number.
std::vector<std::size_t> doubled_ranks(std::span<const double> first, std::span<const double> second) {
  std::vector<double> values(first.begin(), first.end());
  values.insert(values.end(), second.begin(), second.end());
  std::vector<double> sorted = values;
  std::sort(sorted.begin(), sorted.end());
  std::vector<std::size_t> ranks;
  ranks.reserve(values.size());
  for (const double value : values) {
    const auto [from, to] = std::equal_range(sorted.begin(), sorted.end(), value);
    ranks.push_back(static_cast<std::size_t>((from - sorted.begin()) + (to - sorted.begin()) + 1));
  }
  return ranks;
}

std::size_t sum_of(const std::vector<std::size_t>& values, std::size_t count) {
  return std::accumulate(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(count), std::size_t{0});
}

// All choices of `chosen` of the ranks are equally likely. Returns the share of the choices whose sum is at
// least as far from the mean sum as `sum`. Choices of the same size and sum are counted together. There are
// fewer than 2^53 choices.
double exact_p(const std::vector<std::size_t>& ranks, std::size_t chosen, std::size_t sum) {
  const std::size_t total = sum_of(ranks, ranks.size());
  std::vector<std::vector<double>> ways(chosen + 1, std::vector<double>(total + 1, 0.0));
  ways[0][0] = 1.0;
  for (std::size_t seen = 0; seen < ranks.size(); ++seen) {
    for (std::size_t count = std::min(seen + 1, chosen); count > 0; --count) {
      for (std::size_t s = total; s >= ranks[seen]; --s) ways[count][s] += ways[count - 1][s - ranks[seen]];
    }
  }
  // Sum and mean are both multiplied by the number of ranks, so that the mean is a whole number.
  const auto distance = [&](std::size_t s) {
    const std::size_t at = s * ranks.size(), mean = total * chosen;
    return at > mean ? at - mean : mean - at;
  };
  double all = 0.0, as_far = 0.0;
  for (std::size_t s = 0; s <= total; ++s) {
    all += ways[chosen][s];
    if (distance(s) >= distance(sum)) as_far += ways[chosen][s];
  }
  return as_far / all;
}

// Number of pairs in which the value of the second sample is greater; a tie counts half.
double pairs_greater(const std::vector<std::size_t>& ranks, std::size_t first, std::size_t second) {
  const auto n = static_cast<double>(first), m = static_cast<double>(second);
  return n * m + 0.5 * n * (n + 1.0) - 0.5 * static_cast<double>(sum_of(ranks, first));
}

}  // namespace

double normal_p(std::span<const double> first, std::span<const double> second) {
  if (first.empty() || second.empty()) return 1.0;
  std::vector<std::size_t> ranks = doubled_ranks(first, second);
  const auto n = static_cast<double>(first.size()), m = static_cast<double>(second.size()), all = n + m;
  const double u = pairs_greater(ranks, first.size(), second.size());
  std::sort(ranks.begin(), ranks.end());
  double ties = 0.0;  // sum of t³ − t over the groups of t equal values
  for (auto from = ranks.begin(); from != ranks.end();) {
    const auto to = std::upper_bound(from, ranks.end(), *from);
    const auto t = static_cast<double>(to - from);
    ties += t * t * t - t;
    from = to;
  }
  const double variance = n * m / 12.0 * (all + 1.0 - ties / (all * (all - 1.0)));
  if (!(variance > 0.0)) return 1.0;
  // Half a pair as correction for continuity.
  const double off = std::max(0.0, std::fabs(u - 0.5 * n * m) - 0.5);
  return std::erfc(off / std::sqrt(variance) / std::numbers::sqrt2);
}

RankTest rank_test(std::span<const double> first, std::span<const double> second) {
  if (first.empty() || second.empty()) return {};
  const std::vector<std::size_t> ranks = doubled_ranks(first, second);
  RankTest test{.u = pairs_greater(ranks, first.size(), second.size()),
                .p = 1.0,
                .exact = ranks.size() <= kMostExactValues};
  test.p = test.exact ? exact_p(ranks, first.size(), sum_of(ranks, first.size())) : normal_p(first, second);
  return test;
}

double least_p(std::size_t first, std::size_t second) {
  double choices = 1.0;  // number of ways to choose `first` values out of all
  for (std::size_t i = 1; i <= first; ++i)
    choices *= static_cast<double>(second + i) / static_cast<double>(i);
  return std::min(1.0, 2.0 / choices);
}

std::size_t size_for(double p) {
  constexpr std::size_t kMost = 500;  // up to this size the number of choices is finite
  std::size_t size = 1;
  while (size < kMost && least_p(size, size) > p) ++size;
  return size;
}

std::vector<double> benjamini_hochberg(std::span<const double> p) {
  std::vector<std::size_t> order(p.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [p](std::size_t a, std::size_t b) { return p[a] < p[b]; });
  std::vector<double> adjusted(p.size(), 1.0);
  double least = 1.0;
  for (std::size_t rank = order.size(); rank > 0; --rank) {
    const std::size_t i = order[rank - 1];
    least = std::min(least, p[i] * static_cast<double>(p.size()) / static_cast<double>(rank));
    adjusted[i] = least;
  }
  return adjusted;
}

Quartiles quartiles_of(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const auto at = [&values](double share) {
    const double place = share * static_cast<double>(values.size() - 1);
    const auto below = static_cast<std::size_t>(place);
    const double between = place - static_cast<double>(below);
    // The value may be infinite.
    if (between == 0.0 || values[below] == values[below + 1]) return values[below];
    return values[below] + between * (values[below + 1] - values[below]);
  };
  return {at(0.25), at(0.5), at(0.75)};
}

}  // namespace hybrid::bench
