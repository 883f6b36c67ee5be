// SPDX-License-Identifier: GPL-3.0-or-later
// `hybrid bench compare` on reports whose differences are known, and on files that it refuses.
#include "hybrid/bench/reports/compare_reports.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <stdexcept>

#include "hybrid/bench/occupancy.h"
#include "hybrid/bench/reports/report_keys.h"
#include "hybrid/bench/rigid_table.h"
#include "hybrid/bench/soft_table.h"
#include "hybrid/bench/threads.h"

namespace {

namespace fs = std::filesystem;
using hybrid::bench::BenchReport;
using hybrid::bench::compare_reports;
using hybrid::bench::ComparedFigure;
using hybrid::bench::ReportComparison;
using hybrid::bench::Verdict;
using Json = nlohmann::ordered_json;

constexpr int kMeshes = 6;

// A report of the suite `rigid` with random times, as noisy as on a machine that does other work. The
// product's times are multiplied by `slower`.
BenchReport report_of(std::uint64_t seed, double slower = 1.0) {
  std::mt19937_64 random(seed);
  std::lognormal_distribution<double> noise(0.0, 0.1);
  BenchReport report{.file = "made", .version = "1", .machine = "m", .build = "b"};
  for (int mesh = 0; mesh < kMeshes; ++mesh) {
    for (const auto engine : {hybrid::bench::Engine::hybrid, hybrid::bench::Engine::cgal_aabb}) {
      hybrid::bench::RigidRow row;
      row.path = "slide";
      row.mesh = "ico" + std::to_string(mesh);
      row.engine = engine;
      row.ticks = row.path_ticks = 1000;
      row.steps_mean = 1.25;
      const double of_run = noise(random) * (engine == hybrid::bench::Engine::hybrid ? slower : 3.0);
      row.tick_us = {.p50 = of_run * noise(random),
                     .p99 = 2.0 * of_run * noise(random),
                     .p999 = 3.0 * of_run * noise(random),
                     .max = 9.0 * of_run * noise(random)};
      row.build_ms = 20.0 * noise(random);
      report.suites["rigid"].push_back(hybrid::bench::to_json(row));
    }
  }
  return report;
}
std::vector<BenchReport> reports_of(std::uint64_t seed, std::size_t count, double slower = 1.0) {
  std::vector<BenchReport> reports;
  for (std::size_t i = 0; i < count; ++i) reports.push_back(report_of(100 * seed + i, slower));
  return reports;
}

std::size_t changed_in(const ReportComparison& comparison) {
  std::size_t changed = 0;
  for (const ComparedFigure& figure : comparison.figures) changed += figure.verdict == Verdict::changed;
  return changed;
}

TEST(CompareReports, ABuildAgainstItselfIsCalledChangedInAtMostFiveOfAHundred) {
  int called = 0;
  for (std::uint64_t i = 0; i < 100; ++i)
    called += changed_in(compare_reports(reports_of(2 * i, 5), reports_of(2 * i + 1, 5))) > 0;
  EXPECT_LE(called, 5);
}

TEST(CompareReports, WhatTakesHalfAsLongAgainIsFoundAndNothingElse) {
  const auto comparison = compare_reports(reports_of(1, 9), reports_of(2, 9, 1.5));
  std::size_t times = 0, overall = 0;
  for (const ComparedFigure& figure : comparison.figures) {
    const bool slowed = figure.product && figure.key.ends_with("_us");
    if (figure.verdict == Verdict::changed) {
      EXPECT_TRUE(slowed) << figure.row << ' ' << figure.key;
      EXPECT_NEAR(figure.ratio, 1.5, 0.4);
      EXPECT_GT(figure.new_spread->q1, figure.old_spread->median);
      ++times;
      overall += figure.family == hybrid::bench::Family::overall ? 1 : 0;
    }
    if (figure.key == "steps_mean") {
      EXPECT_EQ(figure.verdict, Verdict::same);
    }
  }
  EXPECT_EQ(overall, 2U);  // the median and p99
  EXPECT_GE(times, 4U * kMeshes);
  // The figures of single rows follow, those that a user notices most first. These are the longest times,
  // because they grew most.
  EXPECT_EQ(comparison.figures[overall].key, "max_us");
  for (std::size_t i = overall + 1; i < times; ++i)
    EXPECT_GE(comparison.figures[i - 1].noticed, comparison.figures[i].noticed);
  EXPECT_EQ(hybrid::bench::comparison_summary(comparison).find(std::to_string(times) + " of "), 0U);
}

TEST(CompareReports, SoFewRunsSayNothingOfTimesAndHowManyWould) {
  for (const std::size_t runs : {std::size_t{1}, std::size_t{3}}) {
    const auto comparison = compare_reports(reports_of(1, runs), reports_of(2, runs, 10.0));
    EXPECT_EQ(changed_in(comparison), 0U);
    const std::string words = hybrid::bench::in_words(comparison, false);
    for (const auto family : hybrid::bench::kFamilies) {
      const auto& tested = comparison.tested[static_cast<std::size_t>(family)];
      EXPECT_EQ(tested.at_once, 0U);
      EXPECT_LE(hybrid::bench::least_p(tested.runs_for_one, tested.runs_for_one),
                hybrid::bench::rate_of(family) / static_cast<double>(tested.figures));
      EXPECT_NE(words.find(std::to_string(tested.runs_for_one) + " runs on each side"), std::string::npos);
    }
  }
}

TEST(CompareReports, FiveRunsFindWhatTakesLongerInEveryRow) {
  const auto comparison = compare_reports(reports_of(1, 5), reports_of(2, 5, 1.3));
  ASSERT_GT(changed_in(comparison), 0U);
  const ComparedFigure& first = comparison.figures.front();
  EXPECT_EQ(first.family, hybrid::bench::Family::overall);
  // An overall figure of a run is the geometric mean over the product's rows.
  double log_sum = 0.0;
  const auto report = report_of(100);
  for (const Json& row : report.suites["rigid"])
    if (row["engine"] == "hybrid") log_sum += std::log(row[first.key].get<double>());
  EXPECT_NEAR(first.old_values[0].get<double>(), std::exp(log_sum / kMeshes), 1e-12);
  double sum = 0.0;
  for (const auto family : hybrid::bench::kFamilies) sum += hybrid::bench::rate_of(family);
  EXPECT_NEAR(sum, 0.05, 1e-12);
}

TEST(CompareReports, AnyChangeOfACountIsOneAndIsShownExactly) {
  auto olds = reports_of(1, 1), news = reports_of(2, 1);
  news[0].suites["rigid"][0]["pop_throughs"] = 1;
  olds[0].suites["rigid"][0]["pop_throughs"] = 0;
  news[0].suites["rigid"][2]["steps_mean"] = 1.2500000000000002;
  const auto comparison = compare_reports(olds, news);
  EXPECT_EQ(changed_in(comparison), 2U);
  EXPECT_EQ(comparison.figures[0].key, "pop_throughs");  // listed before figures of the work
  EXPECT_EQ(comparison.figures[1].key, "steps_mean");
  EXPECT_NE(hybrid::bench::in_words(comparison, false).find("1.25 -> 1.2500000000000002"), std::string::npos);
}

TEST(CompareReports, CountsThatDifferBetweenRunsOfABuildAreNoChange) {
  auto olds = reports_of(1, 3), news = reports_of(2, 3);
  for (int i = 0; i < 3; ++i) {
    olds[i].suites["rigid"][0]["steps_max"] = 3 + i;
    news[i].suites["rigid"][0]["steps_max"] = 5 + i;
  }
  EXPECT_EQ(changed_in(compare_reports(olds, news)), 0U);
  for (auto& report : olds)
    report.suites["rigid"][0]["steps_max"] = 3;  // now all runs of the old build agree
  EXPECT_EQ(changed_in(compare_reports(olds, news)), 1U);
}

TEST(CompareReports, FiguresOfOtherTicksAreNotComparedExactly) {
  auto olds = reports_of(1, 1), news = reports_of(2, 1);
  news[0].suites["rigid"][0]["ticks"] = 900;  // the run ended early by its time limit
  news[0].suites["rigid"][0]["contact_ticks"] = 800;
  news[0].suites["rigid"][1]["error_ticks"] = 77;
  news[0].suites["rigid"][1]["error_lost_ticks"] = 5;
  const auto comparison = compare_reports(olds, news);
  EXPECT_EQ(changed_in(comparison), 0U);
  ASSERT_EQ(comparison.caveats.size(), 1U);
  EXPECT_NE(comparison.caveats[0].find("--every-tick"), std::string::npos);
}

TEST(CompareReports, RowsOfOneSideAndOtherMachinesAreSaid) {
  auto olds = reports_of(1, 1), news = reports_of(2, 1);
  news[0].suites["rigid"].erase(0);
  news[0].machine = "another";
  news[0].build = "slow";
  news[0].suites["rigid"][0]["new_key"] = 3;
  const auto comparison = compare_reports(olds, news);
  ASSERT_EQ(comparison.only_old.size(), 1U);
  EXPECT_NE(comparison.only_old[0].find("ico0 hybrid"), std::string::npos) << comparison.only_old[0];
  EXPECT_TRUE(comparison.only_new.empty());
  const std::string words = hybrid::bench::in_words(comparison, false);
  for (const char* said : {"another", "slow", "new_key", comparison.only_old[0].c_str()})
    EXPECT_NE(words.find(said), std::string::npos) << said;
  EXPECT_EQ(words.find("caution"), 0U);
}

TEST(CompareReports, RowsWithTheSameIdentityAreRepeats) {
  BenchReport olds{.file = "a"}, news = olds;
  for (const auto& report : reports_of(1, 9))
    for (const Json& row : report.suites["rigid"]) olds.suites["rigid"].push_back(row);
  for (const auto& report : reports_of(2, 9, 1.5))
    for (const Json& row : report.suites["rigid"]) news.suites["rigid"].push_back(row);
  const auto merged = compare_reports(std::span(&olds, 1), std::span(&news, 1));
  const auto files = compare_reports(reports_of(1, 9), reports_of(2, 9, 1.5));
  EXPECT_EQ(hybrid::bench::to_json(merged)["figures"], hybrid::bench::to_json(files)["figures"]);
}

TEST(CompareReports, WhatIsNeverReachedComesAfterEveryTime) {
  auto olds = reports_of(1, 9), news = reports_of(2, 9);
  for (auto& report : news) report.suites["rigid"][0]["build_ms"] = nullptr;
  const auto comparison = compare_reports(olds, news);
  ASSERT_EQ(changed_in(comparison), 1U);
  EXPECT_EQ(comparison.figures[0].key, "build_ms");
  EXPECT_NE(hybrid::bench::in_words(comparison, false).find("never"), std::string::npos);
}

// A key that is added to a row must also be added to report_keys.cpp.
TEST(CompareReports, EveryKeyOfEveryRowIsKnown) {
  const std::vector<std::pair<std::string, Json>> rows{
      {"rigid", hybrid::bench::to_json(hybrid::bench::RigidRow{})},
      {"soft", hybrid::bench::to_json(hybrid::bench::SoftRow{})},
      {"occupancy", hybrid::bench::to_json(hybrid::bench::OccupancyRow{
                        .op = "lookup", .object_voxels = 1, .box_cells = 1, .reference = "r", .note = "n"})},
      {"threads", hybrid::bench::to_json(hybrid::bench::ThreadsRow{})}};
  for (const auto& [suite, row] : rows) {
    const auto keys = hybrid::bench::keys_of(suite);
    for (const auto& [name, value] : row.items()) {
      EXPECT_TRUE(std::any_of(
          keys.begin(), keys.end(),
          [&name = name](const auto& key) { return key.name.substr(0, key.name.find('.')) == name; }))
          << suite << '.' << name;
    }
    for (const auto& key : keys)
      EXPECT_TRUE(row.contains(key.name.substr(0, key.name.find('.')))) << suite << '.' << key.name;
  }
}

TEST(CompareReports, RefusesWhatIsNoReportWithThePlaceAndARemedy) {
  const fs::path folder = fs::temp_directory_path() / "hybrid-compare-reports";
  fs::create_directories(folder);
  const auto refusal = [&folder](const std::string& text) -> std::string {
    const fs::path file = folder / "report.json";
    std::ofstream(file) << text;
    try {
      (void)hybrid::bench::read_bench_report(file);
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find("report.json: refused: "), std::string::npos);
      EXPECT_NE(std::string(error.what()).find("; "), std::string::npos) << "no remedy";
      return error.what();
    }
    return {};
  };
  const auto says = [](const std::string& text, const char* words) {
    EXPECT_NE(text.find(words), std::string::npos) << text;
  };
  says(refusal(""), "line 1");
  says(refusal("{\n  \"command\": bench}"), "line 2, column 14");
  says(refusal("[1, 2]"), "no `command`");
  says(refusal(R"({"command": "run"})"), "a report of `hybrid run`");
  says(refusal(R"({"command": "bench"})"), "no `suites`");
  says(refusal(R"({"command": "bench", "suites": {"liquid": []}})"), "suites.liquid is unknown");
  says(refusal(R"({"command": "bench", "suites": {"rigid": 3}})"), "suites.rigid is not a list");
  says(refusal(R"({"command": "bench", "suites": {"rigid": [3]}})"), "suites.rigid[0] is not a row");
  Json json{{"command", "bench"}, {"suites", report_of(1).suites}};
  EXPECT_EQ(refusal(json.dump()), "");
  json["suites"]["rigid"][3]["p50_us"] = "fast";
  says(refusal(json.dump()), "suites.rigid[3].p50_us is \"fast\"");
  json["suites"]["rigid"][1].erase("mesh");
  says(refusal(json.dump()), "suites.rigid[1] has no `mesh`");
  EXPECT_THROW((void)hybrid::bench::read_bench_report(folder / "none.json"), std::invalid_argument);
  EXPECT_THROW((void)hybrid::bench::read_bench_report(folder), std::invalid_argument);
  // A copy of a report does not count as another run.
  for (const char* name : {"a.json", "b.json"})
    std::ofstream(folder / name) << Json{{"command", "bench"}, {"suites", report_of(1).suites}}.dump();
  EXPECT_THROW((void)hybrid::bench::read_bench_reports({folder / "a.json", folder / "b.json"}),
               std::invalid_argument);
  fs::remove_all(folder);
}

}  // namespace
