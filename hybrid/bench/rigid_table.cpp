// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/bench/rigid_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "hybrid/base/table.h"
#include "hybrid/session/report.h"

namespace hybrid::bench {
namespace {

using Json = nlohmann::ordered_json;

// JSON has no infinity and no NaN, so these become null. A figure without a meaning is null too.
Json number(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}
Json number(const std::optional<double>& value) {
  return value ? number(*value) : Json(nullptr);
}

Json count(const std::optional<std::size_t>& value) {
  return value ? Json(*value) : Json(nullptr);
}
std::string count_text(const std::optional<std::size_t>& value) {
  return value ? std::to_string(*value) : std::string("-");
}

// The name of the mesh's file without its folder.
std::string mesh_text(const RigidRow& row) {
  return std::filesystem::path(row.mesh).filename().string();
}

// A length as a person reads it: in micrometers up to a millimeter.
std::string length_text(const std::optional<double>& meters) {
  if (!meters) return "-";
  const double um = 1e6 * *meters;
  if (um == 0.0) return "0";
  if (std::fabs(um) < 1e-3) return "<1n";
  return std::fabs(um) < 1000.0 ? fmt::format("{:.3g}u", um) : fmt::format("{:.4g}m", 1e-3 * um);
}

std::string microseconds(double us) {
  return us < 10.0 ? fmt::format("{:.3f}", us) : fmt::format("{:.4g}", us);
}

std::string place_text(const RigidRow& row) {
  std::string text;
  if (row.scale != 1.0) text += fmt::format(" x{:g}", row.scale);
  if (row.offset_m != glm::dvec3(0.0)) text += fmt::format(" +{:g}m", row.offset_m.x);
  return text;
}

bool same_work(const RigidRow& a, const RigidRow& b) {
  return a.path == b.path && a.mesh == b.mesh && a.radius_m == b.radius_m && a.speed_m_s == b.speed_m_s &&
         a.scale == b.scale && a.offset_m == b.offset_m;
}

// Cells of both tables.
std::string ball_text(const RigidRow& row) {
  return row.radius_m > 0.0 ? fmt::format("{:g}", 1e3 * row.radius_m) : "point";
}
std::string speed_text(const RigidRow& row) {
  return fmt::format("{:g}", row.speed_m_s);
}
auto time(double Percentiles::*which) {
  return [which](const RigidRow& row) { return microseconds(row.tick_us.*which); };
}

const Table<RigidRow>& rigid_table() {
  const auto length = [](std::optional<double> Judgement::*value) {
    return [value](const RigidRow& row) { return length_text(row.judged.*value); };
  };
  const auto count = [](std::optional<std::size_t> Judgement::*value) {
    return [value](const RigidRow& row) { return count_text(row.judged.*value); };
  };
  static const Table<RigidRow> table({
      {{"path"}, 10, Side::left, [](const RigidRow& row) { return row.path; }},
      {{"mesh"}, 9, Side::left, mesh_text},
      {{"triangles"}, 9, Side::right, [](const RigidRow& row) { return std::to_string(row.triangles); }},
      {{"ball"}, 5, Side::right, ball_text},
      {{"m/s"}, 6, Side::right, speed_text},
      {{"engine"}, 14, Side::left, [](const RigidRow& row) { return std::string(engine_name(row.engine)); }},
      {{"p50"}, 7, Side::right, time(&Percentiles::p50)},
      {{"p99"}, 7, Side::right, time(&Percentiles::p99)},
      {{"p99.9"}, 7, Side::right, time(&Percentiles::p999)},
      {{"max"}, 7, Side::right, time(&Percentiles::max)},
      {{"slowest"}, 7, Side::right, [](const RigidRow& row) { return microseconds(row.least_us.max); }},
      {{"trunc"}, 5, Side::right, [](const RigidRow& row) { return std::to_string(row.truncated_ticks); }},
      {{"mesh err"}, 8, Side::right, length(&Judgement::error_mesh_max)},
      {{"at"}, 6, Side::right, [](const RigidRow& row) { return std::to_string(row.judged.error_ticks); }},
      {{"sph max"}, 8, Side::right, length(&Judgement::error_sphere_max)},
      {{"sph rms"}, 8, Side::right, length(&Judgement::error_sphere_rms)},
      {{"optimum"}, 8, Side::right, length(&Judgement::optimum_sphere_max)},
      {{"dF p99"},
       7,
       Side::right,
       [](const RigidRow& row) {
         const auto& step = row.judged.force_step_p99_N;
         return step ? fmt::format("{:.4f}", *step) : "-";
       }},
      {{"inside"}, 6, Side::right, count(&Judgement::inside_ticks)},
      {{"pops"}, 5, Side::right, count(&Judgement::pop_throughs)},
      {{"build"}, 7, Side::right, [](const RigidRow& row) { return fmt::format("{:.4g}", row.build_ms); }},
      {{"MB"},
       7,
       Side::right,
       [](const RigidRow& row) { return fmt::format("{:.4g}", 1e-6 * static_cast<double>(row.bytes)); }},
  });
  return table;
}

}  // namespace

Json to_json(const RigidRow& row) {
  const Judgement& j = row.judged;
  Json json{{"path", row.path},
            {"triangles", row.triangles},
            {"radius_m", row.radius_m},
            {"speed_m_s", row.speed_m_s},
            {"engine", engine_name(row.engine)},
            {"p50_us", row.tick_us.p50},
            {"p99_us", row.tick_us.p99},
            {"p999_us", row.tick_us.p999},
            {"max_us", row.tick_us.max},
            {"error_mesh_max_m", number(j.error_mesh_max)},
            {"error_sphere_max_m", number(j.error_sphere_max)},
            {"error_sphere_rms_m", number(j.error_sphere_rms)},
            {"optimum_sphere_max_m", number(j.optimum_sphere_max)},
            {"force_step_p99_N", number(j.force_step_p99_N)},
            {"inside_ticks", count(j.inside_ticks)},
            {"pop_throughs", count(j.pop_throughs)},
            {"build_ms", row.build_ms},
            {"bytes", row.bytes}};
  json["mesh"] = row.mesh;
  json["scale"] = row.scale;
  json["offset_m"] = {row.offset_m.x, row.offset_m.y, row.offset_m.z};
  json["ticks"] = row.ticks;
  json["path_ticks"] = row.path_ticks;
  json["contact_ticks"] = j.contact_ticks;
  json["timer_overhead_us"] = row.timer_overhead_us;
  json["error_ticks"] = j.error_ticks;
  json["error_worst_tick"] = j.error_ticks > 0 ? Json(j.error_worst_tick) : Json(nullptr);
  json["error_mesh_p99_m"] = number(j.error_mesh_p99);
  json["error_lost_ticks"] = j.lost_ticks;
  json["clearance_min_m"] = number(j.clearance_min);
  json["error_closed_max_m"] = number(j.error_closed_max);
  json["error_closed_rms_m"] = number(j.error_closed_rms);
  json["optimum_sphere_rms_m"] = number(j.optimum_sphere_rms);
  json["error_sphere_at_optimum_ticks_max_m"] = number(j.error_sphere_there_max);
  json["steps_mean"] = row.steps_mean;
  json["steps_max"] = row.steps_max;
  json["surveys_per_tick"] = row.surveys_per_tick;
  json["truncated_ticks"] = row.truncated_ticks;
  json["faults"] = row.faults;
  json["pose_us"] = row.pose_us ? hybrid::to_json(*row.pose_us) : Json(nullptr);
  json["least_us"] = hybrid::to_json(row.least_us);
  json["surface_build_ms"] = row.surface_build_ms;
  json["map_build_ms"] = row.map_build_ms;
  return json;
}

std::string table_head() {
  return rigid_table().head();
}

std::string table_line(const RigidRow& row) {
  const Judgement& j = row.judged;
  std::string note = place_text(row);
  if (row.ticks < row.path_ticks) note += fmt::format(" (first {} ticks)", row.ticks);
  if (j.lost_ticks > 0) note += fmt::format(" {} lost", j.lost_ticks);
  if (!row.faults.empty()) note += fmt::format(" {} faults", row.faults.size());
  return rigid_table().line(row, note);
}

namespace {

struct Ratio {
  double value = 0.0;
  bool whole = true;  // false: the other engine was stopped before the end of the path
};

// The ratios of one engine to the product.
class Ratios {
 public:
  Ratios(const std::vector<RigidRow>& rows, Engine engine, double Percentiles::*which)
      : rows_(rows), engine_(engine), which_(which) {}

  [[nodiscard]] std::optional<Ratio> of(const RigidRow& own) const {
    const auto other = std::ranges::find_if(
        rows_, [&](const RigidRow& r) { return r.engine == engine_ && same_work(own, r); });
    if (other == rows_.end() || !(own.least_us.*which_ > 0.0)) return std::nullopt;
    return Ratio{other->least_us.*which_ / (own.least_us.*which_), other->ticks >= own.ticks};
  }
  // The geometric mean over the rows of the product. Partial ratios count only if there are no others.
  [[nodiscard]] std::optional<Ratio> mean() const {
    const std::optional<Ratio> whole = mean_of(true);
    return whole ? whole : mean_of(false);
  }

 private:
  [[nodiscard]] std::optional<Ratio> mean_of(bool whole) const {
    double sum = 0.0;
    std::size_t count = 0;
    for (const RigidRow& row : rows_) {
      if (row.engine != Engine::hybrid) continue;
      const std::optional<Ratio> ratio = of(row);
      if (!ratio || ratio->whole != whole || !(ratio->value > 0.0)) continue;
      sum += std::log(ratio->value);
      ++count;
    }
    if (count == 0) return std::nullopt;
    return Ratio{std::exp(sum / static_cast<double>(count)), whole};
  }

  const std::vector<RigidRow>& rows_;
  Engine engine_;
  double Percentiles::*which_;
};

std::string ratio_text(const std::optional<Ratio>& ratio) {
  if (!ratio) return "-";
  return fmt::format("{:.2f}{}", ratio->value, ratio->whole ? "" : "*");
}

// A row without a path stands for the means.
Table<RigidRow>::Column ratio_column(const std::string& title, const std::string& below, Ratios ratios) {
  return {{title, below}, 8, Side::right, [ratios](const RigidRow& row) {
            return ratio_text(row.path.empty() ? ratios.mean() : ratios.of(row));
          }};
}

}  // namespace

std::string ratio_table(const std::vector<RigidRow>& rows) {
  const auto own_time = [](double Percentiles::*which) {
    return [which](const RigidRow& row) {
      return row.path.empty() ? std::string() : microseconds(row.least_us.*which);
    };
  };
  const auto unless_means = [](auto cell) {
    return [cell](const RigidRow& row) { return row.path.empty() ? std::string() : cell(row); };
  };
  std::vector<Table<RigidRow>::Column> columns{
      {{"path"}, 10, Side::left, [](const RigidRow& row) { return row.path.empty() ? "mean" : row.path; }},
      {{"mesh"}, 9, Side::left, mesh_text},
      {{"ball"}, 5, Side::right, unless_means(ball_text)},
      {{"m/s"}, 6, Side::right, unless_means(speed_text)},
      {{"hybrid", "p50 us"}, 7, Side::right, own_time(&Percentiles::p50)},
      {{"", "p99 us"}, 7, Side::right, own_time(&Percentiles::p99)}};
  bool any = false;
  for (const Engine engine : kEngines) {
    const Ratios p50(rows, engine, &Percentiles::p50), p99(rows, engine, &Percentiles::p99);
    if (engine == Engine::hybrid || !p50.mean()) continue;
    any = true;
    columns.push_back(ratio_column(engine_name(engine), "p50 x", p50));
    columns.push_back(ratio_column("", "p99 x", p99));
  }
  if (!any) return {};
  const Table<RigidRow> table(std::move(columns));
  std::string text = table.head();
  for (const RigidRow& row : rows) {
    if (row.engine == Engine::hybrid) text += table.line(row, place_text(row));
  }
  return text + table.line(RigidRow());
}

}  // namespace hybrid::bench
