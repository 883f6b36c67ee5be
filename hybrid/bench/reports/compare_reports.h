// SPDX-License-Identifier: GPL-3.0-or-later
// Changes between two sets of reports of `hybrid bench`, told from noise as far as runs allow. Rows are
// matched by the keys that identify them (report_keys.h); several with the same ones are repeats.
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

// Measured figures are tested in three families, so that the few that users feel do not need as many runs as
// all of them. `rate` is the share of comparisons of a build with itself in which a figure of the family may
// be called changed; together they are 5 of 100.
enum class Family : std::uint8_t {
  overall,  // of a suite: the geometric mean of a figure over the rows of the product
  felt,     // of a row of the product: median and p99
  other,
};
inline constexpr std::array kFamilies{Family::overall, Family::felt, Family::other};
constexpr double rate_of(Family family) {
  return family == Family::other ? 0.01 : 0.02;
}

enum class Verdict : std::uint8_t {
  same,     // every new value is also an old one
  changed,  // an exact figure is another; or the test tells the two apart
  noise,    // the test does not tell the two apart
  unknown,  // too few repeats for the test to tell anything apart
};

struct ComparedFigure {
  std::string suite, row;           // `row`: the keys that tell it from the others of its suite, in words
  nlohmann::ordered_json identity;  // all keys that identify the row
  std::string key;
  bool product = true;            // not of a baseline
  Family family = Family::other;  // of a ranked one
  bool ranked = false;            // by the rank test; else by equality
  std::size_t rank = 0;           // of its key among those of the suite
  double noticed = 0.0;  // change over the least that a user notices: a tick's period, a second of waiting
  // The values of all runs. For a ranked figure null is infinity: it was never reached.
  std::vector<nlohmann::ordered_json> old_values, new_values;
  std::optional<Quartiles> old_spread, new_spread;  // of ranked ones
  double ratio = 0.0;                               // new median over old; 0: there is none
  RankTest test;
  double false_discovery_rate = 1.0;  // the least at which it counts as changed
  Verdict verdict = Verdict::same;
};

struct ReportComparison {
  std::vector<std::string> caveats;
  std::vector<ComparedFigure> figures;          // changed ones first, then the most noticed
  std::vector<std::string> only_old, only_new;  // rows
  struct Tested {
    std::size_t figures = 0;
    std::size_t at_once = 0;       // so many have to change for the test to name any; 0: never
    std::size_t runs_for_one = 0;  // on each side, to name a single one
  };
  std::array<Tested, kFamilies.size()> tested;  // by family
};

// Neither side may be empty.
ReportComparison compare_reports(std::span<const BenchReport> olds, std::span<const BenchReport> news);

// ---- compare_reports_table.cpp ----
nlohmann::ordered_json to_json(const ReportComparison& comparison);
// "3 of 120 figures changed: …; the rest cannot be told from noise."
std::string comparison_summary(const ReportComparison& comparison);
// Caveats, summary and table. Without `all`, only the first of many rows are listed.
std::string in_words(const ReportComparison& comparison, bool all);

}  // namespace hybrid::bench
