// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/bench/soft_table.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "hybrid/base/table.h"

namespace hybrid::bench {
namespace {

using Json = nlohmann::ordered_json;

template <class T>
Json or_null(const std::optional<T>& value) {
  if constexpr (std::is_floating_point_v<T>) {
    if (value && !std::isfinite(*value)) return nullptr;
  }
  return value ? Json(*value) : Json(nullptr);
}

template <class T>
std::string or_dash(const std::optional<T>& value, const char* format) {
  return value ? fmt::format(fmt::runtime(format), *value) : "-";
}

std::string time_text(const std::optional<Percentiles>& time, double Percentiles::*which) {
  if (!time) return "-";
  const double us = (*time).*which;
  return us < 10.0  ? fmt::format("{:.2f}", us)
         : us < 1e4 ? fmt::format("{:.4g}", us)
                    : fmt::format("{:.0f}", us);
}

struct Line {  // y = intercept + slope·x
  double slope = 0.0, r2 = 0.0;
};
Line least_squares(const std::vector<double>& x, const std::vector<double>& y) {
  const auto n = static_cast<double>(x.size());
  double mean_x = 0.0, mean_y = 0.0, xx = 0.0, xy = 0.0, yy = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    mean_x += x[i] / n;
    mean_y += y[i] / n;
  }
  for (std::size_t i = 0; i < x.size(); ++i) {
    xx += (x[i] - mean_x) * (x[i] - mean_x);
    xy += (x[i] - mean_x) * (y[i] - mean_y);
    yy += (y[i] - mean_y) * (y[i] - mean_y);
  }
  if (!(xx > 0.0) || !(yy > 0.0)) return {};
  return {xy / xx, xy * xy / (xx * yy)};
}

bool in_study(const SoftRow& row) {
  return row.test_case == "wave" && row.material == "homogeneous" && row.axes == 1 && row.moved &&
         *row.moved > 0 && row.depth_spacings && row.slack && row.time_us && row.note.empty();
}

// Slope of log p50 over log(depth / slack).
std::optional<double> time_exponent(const std::vector<SoftRow>& rows, SoftEngine engine) {
  std::vector<double> x, y;
  for (const SoftRow& row : rows) {
    if (!in_study(row) || row.engine != engine || !(row.time_us->p50 > 0.0)) continue;
    x.push_back(std::log(*row.depth_spacings / *row.slack));
    y.push_back(std::log(row.time_us->p50));
  }
  if (x.size() < 3) return std::nullopt;
  return least_squares(x, y).slope;
}

const Table<SoftRow>& soft_table() {
  const auto time = [](double Percentiles::*which) {
    return [which](const SoftRow& row) { return time_text(row.time_us, which); };
  };
  const auto optional = [](auto SoftRow::*value, const char* format) {
    return [value, format](const SoftRow& row) { return or_dash(row.*value, format); };
  };
  static const Table<SoftRow> table({
      {{"case"}, 8, Side::left, [](const SoftRow& row) { return row.test_case; }},
      {{"engine"}, 8, Side::left, [](const SoftRow& row) { return engine_name(row.engine); }},
      {{"voxels"}, 10, Side::right, [](const SoftRow& row) { return std::to_string(row.voxels); }},
      {{"material"}, 12, Side::left, [](const SoftRow& row) { return row.material; }},
      {{"depth"}, 5, Side::right, optional(&SoftRow::depth_spacings, "{:.4g}")},
      {{"slack"}, 5, Side::right, optional(&SoftRow::slack, "{:.3g}")},
      {{"axes"}, 4, Side::right, optional(&SoftRow::axes, "{}")},
      {{"moved"}, 8, Side::right, optional(&SoftRow::moved, "{}")},
      {{"viol"}, 5, Side::right, optional(&SoftRow::violated, "{}")},
      {{"exact"},
       5,
       Side::right,
       [](const SoftRow& row) { return !row.exact   ? "-"
                                       : *row.exact ? "yes"
                                                    : "no"; }},
      {{"p50"}, 9, Side::right, time(&Percentiles::p50)},
      {{"p99"}, 9, Side::right, time(&Percentiles::p99)},
      {{"p99.9"}, 9, Side::right, time(&Percentiles::p999)},
      {{"max"}, 9, Side::right, time(&Percentiles::max)},
      {{"speedup"}, 8, Side::right, optional(&SoftRow::speedup, "{:.2f}")},
      {{"ns/vox"}, 6, Side::right, optional(&SoftRow::ns_per_voxel_update, "{:.1f}")},
      {{"trunc"}, 6, Side::right, optional(&SoftRow::truncated_share, "{:.3f}")},
      {{"err N"}, 8, Side::right, optional(&SoftRow::force_error_N, "{:.4f}")},
      {{"JND"}, 6, Side::right, optional(&SoftRow::force_error_jnd, "{:.2f}")},
      {{"B/vox"}, 6, Side::right, optional(&SoftRow::bytes_per_voxel, "{:.2f}")},
  });
  return table;
}

}  // namespace

const char* engine_name(SoftEngine engine) {
  return engine == SoftEngine::classic ? "classic" : "hybrid";
}

Json to_json(const SoftRow& row) {
  const auto time = [&row](double Percentiles::*which) {
    return row.time_us ? Json((*row.time_us).*which) : Json(nullptr);
  };
  Json json{{"case", row.test_case},
            {"engine", engine_name(row.engine)},
            {"voxels", row.voxels},
            {"material", row.material},
            {"depth_spacings", or_null(row.depth_spacings)},
            {"slack", or_null(row.slack)},
            {"axes", or_null(row.axes)},
            {"threads", row.threads},
            {"moved", or_null(row.moved)},
            {"violated", or_null(row.violated)},
            {"p50_us", time(&Percentiles::p50)},
            {"p99_us", time(&Percentiles::p99)},
            {"p999_us", time(&Percentiles::p999)},
            {"max_us", time(&Percentiles::max)},
            {"speedup", or_null(row.speedup)},
            {"ns_per_voxel_update", or_null(row.ns_per_voxel_update)},
            {"truncated_share", or_null(row.truncated_share)},
            {"force_error_N", or_null(row.force_error_N)},
            {"force_error_jnd", or_null(row.force_error_jnd)},
            {"reference", row.reference.empty() ? Json(nullptr) : Json(row.reference)},
            {"bytes_per_voxel", or_null(row.bytes_per_voxel)}};
  json["repeats"] = row.repeats;
  json["ns_per_candidate"] = or_null(row.ns_per_candidate);
  json["exact"] = or_null(row.exact);
  json["source_off_spacings"] = or_null(row.source_off_spacings);
  json["note"] = row.note.empty() ? Json(nullptr) : Json(row.note);
  return json;
}

std::string soft_table_head() {
  return soft_table().head();
}

std::string soft_table_line(const SoftRow& row) {
  return soft_table().line(row, row.note.empty() ? "" : " " + row.note);
}

std::optional<Growth> growth_of(const std::vector<SoftRow>& rows) {
  std::set<std::pair<double, std::size_t>> points;  // one for each ratio and count, from any engine
  for (const SoftRow& row : rows) {
    if (in_study(row)) points.insert({*row.depth_spacings / *row.slack, *row.moved});
  }
  std::set<double> ratios;
  std::vector<double> ratio, log_ratio, log_moved;
  for (const auto& [x, moved] : points) {
    ratios.insert(x);
    ratio.push_back(x);
    log_ratio.push_back(std::log(x));
    log_moved.push_back(std::log(static_cast<double>(moved)));
  }
  if (ratios.size() < 3) return std::nullopt;
  const Line power = least_squares(log_ratio, log_moved);
  return Growth{.points = points.size(),
                .moved_exponent = power.slope,
                .moved_r2 = power.r2,
                .exponential_r2 = least_squares(ratio, log_moved).r2,
                .hybrid_time_exponent = time_exponent(rows, SoftEngine::hybrid),
                .classic_time_exponent = time_exponent(rows, SoftEngine::classic)};
}

Json to_json(const Growth& growth) {
  return {{"over", "depth_spacings / slack, homogeneous, one axis"},
          {"points", growth.points},
          {"moved_exponent", growth.moved_exponent},
          {"moved_r2", growth.moved_r2},
          {"exponential_r2", growth.exponential_r2},
          {"time_exponent",
           {{"hybrid", or_null(growth.hybrid_time_exponent)},
            {"classic", or_null(growth.classic_time_exponent)}}}};
}

std::string in_words(const Growth& growth) {
  std::string text = fmt::format(
      "moved voxels grow as (depth/slack)^{:.2f} (R2 {:.5f} of {} waves; an exponential fits with R2 {:.3f})",
      growth.moved_exponent, growth.moved_r2, growth.points, growth.exponential_r2);
  if (growth.classic_time_exponent)
    text += fmt::format("; classic's time as its power {:.2f}", *growth.classic_time_exponent);
  if (growth.hybrid_time_exponent)
    text += fmt::format("; hybrid's as its power {:.2f}", *growth.hybrid_time_exponent);
  return text + "\n";
}

}  // namespace hybrid::bench
