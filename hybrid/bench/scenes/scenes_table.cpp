// SPDX-License-Identifier: GPL-3.0-or-later
// The rows of bench_scenes() as text and as JSON.
#include <fmt/format.h>

#include <algorithm>

#include "hybrid/base/table.h"
#include "hybrid/bench/scenes/bench_scenes.h"
#include "hybrid/models/variants.h"
#include "hybrid/session/report.h"

namespace hybrid::bench {
namespace {

std::string median_of(const OverRepeats& of) {
  return fmt::format("{:.{}f}", of.median, of.median < 10.0 ? 1 : 0);
}

std::string ratio_of(const SceneRow& row) {
  const std::string text = row.p99_ratio < 0.1    ? fmt::format("{:.1g}", row.p99_ratio)
                           : row.p99_ratio < 10.0 ? fmt::format("{:.2f}", row.p99_ratio)
                                                  : fmt::format("{:.0f}", row.p99_ratio);
  return text + (row.sure || row.model == kAsGiven ? "" : "?");
}

const Table<SceneRow>& table() {
  using Row = SceneRow;
  const auto time = [](OverRepeats Row::*which) {
    return [which](const Row& r) { return median_of(r.*which); };
  };
  static const Table<Row> kTable({
      {{"scene"}, 15, Side::left, [](const Row& r) { return r.scene; }},
      {{"model"}, 14, Side::left, [](const Row& r) { return r.model; }},
      {{"tick us", "p50"}, 7, Side::right, time(&Row::p50_us)},
      {{"", "p99"}, 5, Side::right, time(&Row::p99_us)},
      {{"", "p99.9"}, 5, Side::right, time(&Row::p999_us)},
      {{"", "max"}, 6, Side::right, time(&Row::max_us)},
      {{"p99 over", "repeats"},
       11,
       Side::right,
       [](const Row& r) { return fmt::format("{:.3g}-{:.3g}", r.p99_us.least, r.p99_us.most); }},
      {{"p99 of", "given"}, 6, Side::right, ratio_of},
      {{"error", "JND"},
       5,
       Side::right,
       [](const Row& r) {
         return r.own_error.all.samples > 0 ? fmt::format("{:.1f}", r.own_error.all.max_jnd) : "-";
       }},
      {{"off by", "JND"},
       6,
       Side::right,
       [](const Row& r) {
         return r.model == kAsGiven ? "" : fmt::format("{:.1f}", r.from_given.worst_jnd());
       }},
      {{"MB"},
       6,
       Side::right,
       [](const Row& r) { return fmt::format("{:.1f}", 1e-6 * static_cast<double>(r.memory_bytes)); }},
      {{"load s"}, 6, Side::right, [](const Row& r) { return fmt::format("{:.2f}", r.load_s); }},
  });
  return kTable;
}

nlohmann::ordered_json json_of(const OverRepeats& of) {
  return {{"median", of.median}, {"least", of.least}, {"most", of.most}};
}

nlohmann::ordered_json json_of(const FeltError& e) {
  return {{"ticks", e.ticks}, {"jnd_p50", e.p50_jnd}, {"jnd_p99", e.p99_jnd}, {"jnd_max", e.max_jnd}};
}

}  // namespace

std::string scenes_table_head() {
  return table().head();
}

std::string scenes_table_line(const SceneRow& row) {
  if (!row.left_out.empty())
    return fmt::format("{:15} {:14} not played: {}\n", row.scene, row.model, row.left_out);
  std::string text = table().line(row);
  for (const std::string& fault : row.faults) text += fmt::format("  fault: {}\n", fault);
  return text;
}

std::string scenes_summary(const std::vector<SceneRow>& rows) {
  std::string text =
      "times: median over the repeats of each percentile, in us; p99 of given: median ratio within a turn; "
      "?: "
      "not the same way\n  in every turn. error: the greatest against the same session played slowly; off "
      "by: "
      "p99 against the scene as given\n";
  std::size_t played = 0, loud = 0;
  for (const SceneRow& row : rows) {
    played += row.left_out.empty() ? 1 : 0;
    loud += noisy(row) ? 1 : 0;
  }
  if (loud > 0) {
    text += fmt::format(
        "the machine was noisy: in {} of {} rows the p99 differed by more than {:.0f} % between repeats; "
        "trust "
        "ratios without ? only\n",
        loud, played, 100.0 * kNoisy);
  }
  return text;
}

nlohmann::ordered_json to_json(const SceneRow& row) {
  nlohmann::ordered_json j{{"scene", row.scene}, {"model", row.model}, {"values", row.values}};
  j["left_out"] =
      row.left_out.empty() ? nlohmann::ordered_json(nullptr) : nlohmann::ordered_json(row.left_out);
  if (!row.left_out.empty()) return j;
  j["ticks"] = row.ticks;
  j["contact_ticks"] = row.contact_ticks;
  j["repeats"] = row.repeats;
  j["p50_us"] = json_of(row.p50_us);
  j["p99_us"] = json_of(row.p99_us);
  j["p999_us"] = json_of(row.p999_us);
  j["max_us"] = json_of(row.max_us);
  j["p99_ratio"] = row.p99_ratio;
  j["p99_ratio_sure"] = row.sure;
  j["noisy"] = noisy(row);
  const ForceError& own = row.own_error;
  const bool measured = own.all.samples > 0;
  j["force_error_N"] = measured ? nlohmann::ordered_json(own.all.max_N) : nlohmann::ordered_json(nullptr);
  j["force_error_jnd"] = measured ? nlohmann::ordered_json(own.all.max_jnd) : nlohmann::ordered_json(nullptr);
  j["force_error_p99_jnd"] = measured ? nlohmann::ordered_json(own.p99_jnd) : nlohmann::ordered_json(nullptr);
  j["reference"] = measured ? reference_words(own) : own.not_measured;
  j["from_given"] = {{"moving", json_of(row.from_given.moving)}, {"still", json_of(row.from_given.still)}};
  j["memory_bytes"] = row.memory_bytes;
  j["soft_voxels"] = row.soft_voxels;
  j["load_s"] = row.load_s;
  j["faults"] = row.faults;
  return j;
}

}  // namespace hybrid::bench
