// SPDX-License-Identifier: GPL-3.0-or-later
// Changes between two sets of reports of `hybrid bench`, told from noise as far as the runs allow. Rows are
// matched by the keys that identify them (report_keys.h). Several rows with the same keys are repeats.
#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hybrid/bench/reports/rank_test.h"
#include "hybrid/bench/reports/read_reports.h"

namespace hybrid::bench {

// Measured figures are tested in three families. Users feel only a few figures. These few have families of
// their own, because a small family needs fewer runs. `rate` is the share of comparisons of a build with
// itself in which some figure of the family may be called changed. The rates add up to 5 %.
enum class Family : std::uint8_t {
  overall,  // geometric mean of a figure over the product's rows in a suite
  felt,     // median and p99 of a row of the product
  other,
};
inline constexpr std::array kFamilies{Family::overall, Family::felt, Family::other};
constexpr double rate_of(Family family) {
  return family == Family::other ? 0.01 : 0.02;
}

enum class Verdict : std::uint8_t {
  same,     // every new value is also an old one
  changed,  // an exact figure differs, or the test tells the two sides apart
  noise,    // the test does not tell the two sides apart
  unknown,  // there are too few repeats for the test to tell anything apart
};

struct ComparedFigure {
  std::string suite, row;           // `row`: the keys that tell it from other rows of its suite, in words
  nlohmann::ordered_json identity;  // all keys that identify the row
  std::string key;
  bool product = true;            // false: the row is of a baseline
  Family family = Family::other;  // only of a ranked figure
  bool ranked = false;            // judged by the rank test; otherwise by equality
  std::size_t rank = 0;           // place of its key among the keys of the suite
  double noticed =
      0.0;  // change / least change that a user notices (a tick's period, or a second of waiting)
  // The values of all runs. In a ranked figure null stands for infinity: the goal was never reached.
  std::vector<nlohmann::ordered_json> old_values, new_values;
  std::optional<Quartiles> old_spread, new_spread;  // only of ranked figures
  double ratio = 0.0;                               // new median over old median; 0: not defined
  RankTest test;
  double false_discovery_rate = 1.0;  // least rate at which the figure counts as changed
  Verdict verdict = Verdict::same;
};

struct ReportComparison {
  std::vector<std::string> caveats;
  std::vector<ComparedFigure> figures;          // changed ones first, then those that users notice most
  std::vector<std::string> only_old, only_new;  // rows that only one side has
  struct Tested {
    std::size_t figures = 0;
    // Least number of changed figures at which the test can name any of them; 0: no number suffices.
    std::size_t at_once = 0;
    std::size_t runs_for_one = 0;  // runs on each side that are needed to name a single figure
  };
  std::array<Tested, kFamilies.size()> tested;  // one for each family
};

// There must be at least one report on each side.
ReportComparison compare_reports(std::span<const BenchReport> olds, std::span<const BenchReport> news);

// ---- compare_reports_table.cpp ----
nlohmann::ordered_json to_json(const ReportComparison& comparison);
// For example "3 of 120 figures changed: …; the rest cannot be told from noise."
std::string comparison_summary(const ReportComparison& comparison);
// Caveats, summary and table. Without `all`, long tables list only their first rows.
std::string in_words(const ReportComparison& comparison, bool all);

}  // namespace hybrid::bench
