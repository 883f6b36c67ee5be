// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/bench/reports/read_reports.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "hybrid/bench/reports/report_keys.h"

namespace hybrid::bench {
namespace {

constexpr const char* kHowToMake = "write one with `hybrid bench SUITE --json FILE`";

[[noreturn]] void refuse_report(const std::string& file, const std::string& why, const std::string& remedy) {
  throw std::invalid_argument(fmt::format("{}: refused: {}; {}", file, why, remedy));
}

std::string text_of_report(const std::filesystem::path& file) {
  errno = 0;
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  if (in && std::filesystem::is_regular_file(file)) text << in.rdbuf();
  if (!in || !std::filesystem::is_regular_file(file))
    refuse_report(file.string(),
                  fmt::format("cannot be read ({})", errno != 0 ? std::strerror(errno) : "not a file"),
                  "check the name and the rights");
  return text.str();
}

std::string string_or_empty(const nlohmann::ordered_json& report, const char* key) {
  const auto found = report.find(key);
  return found != report.end() && found->is_string() ? found->get<std::string>() : std::string();
}

// Line and column of a byte, counted as in editors.
std::string line_and_column(const std::string& text, std::size_t byte) {
  std::size_t line = 1, column = 1;
  for (std::size_t i = 0; i + 1 < byte && i < text.size(); ++i) {
    column = text[i] == '\n' ? 1 : column + 1;
    line += text[i] == '\n' ? 1 : 0;
  }
  return fmt::format("line {}, column {}", line, column);
}

void check_row(const std::string& file, const std::string& suite, std::size_t index,
               const nlohmann::ordered_json& row) {
  const std::string place = fmt::format("suites.{}[{}]", suite, index);
  const char* remedy = "the file was changed or is of another program; measure anew";
  if (!row.is_object()) refuse_report(file, place + " is not a row", remedy);
  for (const ReportKey& key : keys_of(suite)) {
    const nlohmann::ordered_json value = value_at(row, key.name);
    if (key.kind == KeyKind::identity && key.name != "box_cells" && !row.contains(key.name))
      refuse_report(file, fmt::format("{} has no `{}`", place, key.name), remedy);
    if (key.kind == KeyKind::measured && !value.is_null() && !value.is_number())
      refuse_report(file, fmt::format("{}.{} is {} where a number belongs", place, key.name, value.dump()),
                    remedy);
  }
}

}  // namespace

nlohmann::ordered_json value_at(const nlohmann::ordered_json& row, std::string_view key) {
  const std::size_t dot = key.find('.');
  const auto found = row.find(key.substr(0, dot));
  if (found == row.end()) return nullptr;
  if (dot == std::string_view::npos) return *found;
  return found->is_object() ? value_at(*found, key.substr(dot + 1)) : nlohmann::ordered_json(nullptr);
}

BenchReport read_bench_report(const std::filesystem::path& file) {
  const std::string name = file.string(), text = text_of_report(file);
  nlohmann::ordered_json json;
  try {
    json = nlohmann::ordered_json::parse(text);
  } catch (const nlohmann::ordered_json::parse_error& error) {
    refuse_report(name, "not JSON at " + line_and_column(text, error.byte), kHowToMake);
  } catch (const nlohmann::ordered_json::exception& error) {
    refuse_report(name, std::string("not JSON: ") + error.what(), kHowToMake);
  }
  const std::string command = json.is_object() ? string_or_empty(json, "command") : std::string();
  if (command.empty()) refuse_report(name, "not a report of `hybrid`: it has no `command`", kHowToMake);
  if (command != "bench")
    refuse_report(name, fmt::format("a report of `hybrid {}`, not of `hybrid bench`", command), kHowToMake);
  const auto suites = json.find("suites");
  if (suites == json.end() || !suites->is_object())
    refuse_report(name, "it has no `suites`", "it was cut or changed; measure anew");
  for (const auto& [suite, rows] : suites->items()) {
    if (keys_of(suite).empty())
      refuse_report(
          name, fmt::format("suites.{} is unknown here; rigid, soft, occupancy and threads are known", suite),
          "use the `hybrid` that wrote it");
    if (!rows.is_array())
      refuse_report(name, fmt::format("suites.{} is not a list of rows", suite), "measure anew");
    for (std::size_t i = 0; i < rows.size(); ++i) check_row(name, suite, i, rows[i]);
  }
  const auto is_true = [&json](const char* key) {
    const auto found = json.find(key);
    return found != json.end() && *found == true;
  };
  return {.file = name,
          .version = string_or_empty(json, "version"),
          .machine = string_or_empty(json, "machine"),
          .build = string_or_empty(json, "build"),
          .quick = is_true("quick"),
          .stopped = is_true("stopped"),
          .suites = *suites};
}

std::vector<BenchReport> read_bench_reports(const std::vector<std::filesystem::path>& files) {
  std::vector<BenchReport> reports;
  for (const std::filesystem::path& file : files) {
    reports.push_back(read_bench_report(file));
    for (std::size_t i = 0; i + 1 < reports.size(); ++i) {
      if (reports[i].suites == reports.back().suites && !reports[i].suites.empty())
        refuse_report(reports.back().file, "the same report as " + reports[i].file,
                      "a repeat has to be measured anew");
    }
  }
  return reports;
}

}  // namespace hybrid::bench
