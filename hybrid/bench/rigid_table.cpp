// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/bench/rigid_table.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "hybrid/session/report.h"

namespace hybrid::bench {
namespace {

using Json = nlohmann::ordered_json;

// What is no number in JSON (and what has no meaning) is null.
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

// The file alone of a path.
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
  json["surface_build_ms"] = row.surface_build_ms;
  json["map_build_ms"] = row.map_build_ms;
  return json;
}

std::string table_head() {
  return fmt::format(
      "{:<10} {:<9} {:>9} {:>5} {:>6} {:<9} {:>7} {:>7} {:>7} {:>7} {:>8} {:>6} {:>8} {:>8} {:>8} {:>7} "
      "{:>6} "
      "{:>5} {:>7} {:>7}\n",
      "path", "mesh", "triangles", "ball", "m/s", "engine", "p50", "p99", "p99.9", "max", "mesh err", "at",
      "sph max", "sph rms", "optimum", "dF p99", "inside", "pops", "build", "MB");
}

std::string table_line(const RigidRow& row) {
  const Judgement& j = row.judged;
  std::string line = fmt::format(
      "{:<10} {:<9} {:>9} {:>5} {:>6g} {:<9} {:>7} {:>7} {:>7} {:>7} {:>8} {:>6} {:>8} {:>8} {:>8} {:>7} "
      "{:>6} "
      "{:>5} {:>7.4g} {:>7.4g}",
      row.path, mesh_text(row), row.triangles,
      row.radius_m > 0.0 ? fmt::format("{:g}", 1e3 * row.radius_m) : "point", row.speed_m_s,
      engine_name(row.engine), microseconds(row.tick_us.p50), microseconds(row.tick_us.p99),
      microseconds(row.tick_us.p999), microseconds(row.tick_us.max), length_text(j.error_mesh_max),
      j.error_ticks, length_text(j.error_sphere_max), length_text(j.error_sphere_rms),
      length_text(j.optimum_sphere_max),
      j.force_step_p99_N ? fmt::format("{:.4f}", *j.force_step_p99_N) : "-", count_text(j.inside_ticks),
      count_text(j.pop_throughs), row.build_ms, 1e-6 * static_cast<double>(row.bytes));
  line += place_text(row);
  if (row.ticks < row.path_ticks) line += fmt::format(" (first {} ticks)", row.ticks);
  if (j.lost_ticks > 0) line += fmt::format(" {} lost", j.lost_ticks);
  if (row.truncated_ticks > 0) line += fmt::format(" {} truncated", row.truncated_ticks);
  if (!row.faults.empty()) line += fmt::format(" {} faults", row.faults.size());
  return line + "\n";
}

std::string ratio_table(const std::vector<RigidRow>& rows) {
  std::string text =
      fmt::format("{:<10} {:<9} {:>5} {:>6} {:>9} {:>9} | {:>22} | {:>22}\n", "path", "mesh", "ball", "m/s",
                  "p50 us", "p99 us", "cgal-aabb x p50, p99", "no-map x p50, p99");
  bool any = false;
  for (const RigidRow& row : rows) {
    if (row.engine != Engine::hybrid) continue;
    const auto beside = [&](Engine engine) -> std::string {
      for (const RigidRow& other : rows) {
        if (other.engine != engine || !same_work(row, other)) continue;
        any = true;
        return fmt::format("{:>11.2f} {:>10.2f}", other.tick_us.p50 / row.tick_us.p50,
                           other.tick_us.p99 / row.tick_us.p99);
      }
      return fmt::format("{:>22}", "-");
    };
    text += fmt::format("{:<10} {:<9} {:>5} {:>6g} {:>9} {:>9} | {} | {}{}\n", row.path, mesh_text(row),
                        row.radius_m > 0.0 ? fmt::format("{:g}", 1e3 * row.radius_m) : "point", row.speed_m_s,
                        microseconds(row.tick_us.p50), microseconds(row.tick_us.p99),
                        beside(Engine::cgal_aabb), beside(Engine::no_map), place_text(row));
  }
  return any ? text : std::string();
}

}  // namespace hybrid::bench
