// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/validate/table.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "hybrid/base/table.h"

namespace hybrid {
namespace {

nlohmann::ordered_json or_null(const std::optional<double>& value) {
  return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json(nullptr);
}

std::string spread_words(const ValidationRow& row) {
  return row.low && row.high ? fmt::format("{:.4g} to {:.4g}", *row.low, *row.high) : "";
}

// Share in percent, rounded to one decimal. Never "-0.0".
double percent(double share) {
  return std::round(1000.0 * share) / 10.0 + 0.0;
}

std::string verdict_words(const ValidationRow& row) {
  if (row.fails()) return "FAILS";
  if (row.inside()) return row.stated ? "holds" : "inside";
  return "outside";
}

const Table<ValidationRow>& validation_columns() {
  constexpr std::size_t kCaseLetters = 62, kQuantityLetters = 52;  // widths of two columns
  static const Table<ValidationRow> table({
      {{" case"},
       kCaseLetters + 1,
       Side::left,
       [](const ValidationRow& row) { return " " + shortened(row.name, kCaseLetters); }},
      {{"quantity"},
       kQuantityLetters,
       Side::left,
       [](const ValidationRow& row) { return shortened(row.quantity, kQuantityLetters); }},
      {{"reference"},
       10,
       Side::right,
       [](const ValidationRow& row) { return fmt::format("{:.4g}", row.reference); }},
      {{"spread"}, 16, Side::left, spread_words},
      {{"ours"}, 10, Side::right, [](const ValidationRow& row) { return fmt::format("{:.4g}", row.ours); }},
      {{"difference"},
       10,
       Side::right,
       [](const ValidationRow& row) { return fmt::format("{:+.1f} %", percent(row.difference())); }},
      {{"bound"},
       9,
       Side::right,
       [](const ValidationRow& row) {
         return row.bound ? fmt::format("{:.1f} %", 100.0 * *row.bound) : "spread";
       }},
      {{" verdict"}, 0, Side::left, [](const ValidationRow& row) { return " " + verdict_words(row); }},
  });
  return table;
}

}  // namespace

void add_to_json(const ValidationReport& report, nlohmann::ordered_json& json) {
  const ValidationCount sum = count(report);
  json["verdict"] = verdict(report);
  json["seconds"] = report.seconds;
  json["stated"] = sum.stated;
  json["failed"] = sum.failed;
  json["rows"] = nlohmann::ordered_json::array();
  for (const ValidationRow& row : report.rows) {
    json["rows"].push_back({{"group", row.group},
                            {"case", row.name},
                            {"quantity", row.quantity},
                            {"unit", row.unit},
                            {"source", row.source},
                            {"reference", row.reference},
                            {"reference_low", or_null(row.low)},
                            {"reference_high", or_null(row.high)},
                            {"ours", row.ours},
                            {"difference", row.difference()},
                            {"bound", or_null(row.bound)},
                            {"stated", row.stated},
                            {"inside", row.inside()},
                            {"why", row.inside() || row.why.empty() ? nlohmann::ordered_json(nullptr)
                                                                    : nlohmann::ordered_json(row.why)}});
  }
  json["moduli"] = nlohmann::ordered_json::array();
  for (const FittedModulus& m : report.moduli) {
    json["moduli"].push_back({{"case", m.name},
                              {"slipping_Pa", m.slipping_Pa},
                              {"bonded_Pa", m.bonded_Pa},
                              {"published_Pa", or_null(m.published_Pa)}});
  }
}

std::string validation_table(const ValidationReport& report) {
  std::string text, group;
  std::size_t left_out = 0;
  for (const ValidationRow& row : report.rows) {
    if (row.detail && !row.fails()) {
      ++left_out;
      continue;
    }
    if (row.group != group) {
      group = row.group;
      text += fmt::format("\n{}\n", group);
    }
    text += validation_columns().line(row);
    if (!row.inside() && !row.why.empty()) text += fmt::format("      {}\n", row.why);
  }
  return validation_columns().head() + text +
         fmt::format("\n{} more rows are in the report (--json, --report), with the sources of all.\n{}\n",
                     left_out, verdict(report));
}

}  // namespace hybrid
