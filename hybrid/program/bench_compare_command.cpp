// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "hybrid/bench/reports/compare_reports.h"
#include "hybrid/bench/reports/read_reports.h"
#include "hybrid/program/commands.h"
#include "hybrid/session/outputs.h"
#include "hybrid/session/report.h"

namespace hybrid {
namespace {

void say_side(std::FILE* words, const char* side, const std::vector<bench::BenchReport>& reports) {
  const bench::BenchReport& first = reports.front();
  fmt::print(words, "{}: {}{}, version {}{} on {}\n", side, first.file,
             reports.size() > 1 ? fmt::format(" and {} more", reports.size() - 1) : std::string(),
             first.version.empty() ? "unknown" : first.version,
             first.build.empty() ? std::string() : fmt::format(" ({})", first.build),
             first.machine.empty() ? "an unknown machine" : first.machine);
}

}  // namespace

int bench_compare(const BenchCompareCommand& command) {
  Outputs outputs;
  outputs.ask_json(command.json);
  const std::vector<bench::BenchReport> olds = bench::read_bench_reports(command.olds),
                                        news = bench::read_bench_reports(command.news);
  const bench::ReportComparison comparison = bench::compare_reports(olds, news);
  std::FILE* words = outputs.words();
  say_side(words, "old", olds);
  say_side(words, "new", news);
  fmt::print(words, "{}", bench::in_words(comparison, command.all));
  nlohmann::ordered_json report = report_head("bench compare");
  const auto names = [](const std::vector<bench::BenchReport>& reports) {
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (const bench::BenchReport& r : reports) list.push_back(r.file);
    return list;
  };
  report["old_files"] = names(olds);
  report["new_files"] = names(news);
  report.update(bench::to_json(comparison));
  outputs.write_json(command.json, report);
  return outputs.failed() ? 1 : 0;
}

}  // namespace hybrid
