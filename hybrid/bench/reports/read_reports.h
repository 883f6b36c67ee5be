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
  std::string version{}, machine{}, build{};  // empty: the report does not say
  bool quick = false, stopped = false;
  nlohmann::ordered_json suites{};  // name: rows; each row has the keys that identify it
};

// Throws std::invalid_argument, with the file, the place in it and a remedy: not readable, not JSON, not a
// report of `hybrid bench`, or rows that are not those of REPORTS.md.
BenchReport read_bench_report(const std::filesystem::path& file);

// The same of a side of a comparison. A file that is given twice, or a copy of one, is refused: it is not a
// run of its own.
std::vector<BenchReport> read_bench_reports(const std::vector<std::filesystem::path>& files);

// The value of "pose_us.p99", or of a plain key; null where there is none.
nlohmann::ordered_json value_at(const nlohmann::ordered_json& row, std::string_view key);

}  // namespace hybrid::bench
