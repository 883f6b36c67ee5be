// SPDX-License-Identifier: GPL-3.0-or-later
// Reads reports of `hybrid bench`, and refuses other files.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace hybrid::bench {

struct BenchReport {
  std::string file;
  std::string version{}, machine{}, build{};  // empty: not in the report
  bool quick = false, stopped = false;
  nlohmann::ordered_json suites{};  // rows by the name of the suite; each row has the keys that identify it
};

// Throws std::invalid_argument with the file, the place in it and a remedy: the file is not readable, not
// JSON, no report of `hybrid bench`, or its rows do not match REPORTS.md.
BenchReport read_bench_report(const std::filesystem::path& file);

// Reads all reports of one side of a comparison. Throws std::invalid_argument as read_bench_report() does. A
// file that is given twice, or a copy of one, is also refused, because it is not a separate run.
std::vector<BenchReport> read_bench_reports(const std::vector<std::filesystem::path>& files);

// The value of a key such as "pose_us.p99", or of a plain key; null if it is missing.
nlohmann::ordered_json value_at(const nlohmann::ordered_json& row, std::string_view key);

}  // namespace hybrid::bench
