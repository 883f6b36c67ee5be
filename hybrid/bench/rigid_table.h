// SPDX-License-Identifier: GPL-3.0-or-later
// The rows of `hybrid bench rigid`: as JSON, as a table, and as a table of ratios between engines.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "hybrid/bench/rigid_errors.h"
#include "hybrid/session/session.h"

namespace hybrid::bench {

struct RigidRow {
  std::string path, mesh;
  std::size_t triangles = 0;
  double radius_m = 0.0, speed_m_s = 0.0, scale = 1.0;
  glm::dvec3 offset_m{0.0};
  Engine engine = Engine::hybrid;
  std::size_t ticks = 0, path_ticks = 0;  // ticks that were measured; ticks of the whole path
  Percentiles tick_us;
  // Percentiles of TouchRun::least_us.
  Percentiles least_us;
  std::optional<Percentiles> pose_us;  // time of moving the body
  double timer_overhead_us = 0.0;
  double steps_mean = 0.0, surveys_per_tick = 0.0;
  std::uint32_t steps_max = 0;
  std::uint64_t truncated_ticks = 0;
  std::vector<std::string> faults;
  double build_ms = 0.0, surface_build_ms = 0.0, map_build_ms = 0.0;
  std::size_t bytes = 0;
  Judgement judged;
};

nlohmann::ordered_json to_json(const RigidRow& row);

std::string table_head();
std::string table_line(const RigidRow& row);
// A row for each path and mesh: p50 and p99 of the product's least times, and the ratios of the other
// engines' times to them. The last row has the geometric means of the ratios. Times include moving the body.
// A star marks an engine that was stopped before the end of the path; the mean leaves it out.
std::string ratio_table(const std::vector<RigidRow>& rows);

}  // namespace hybrid::bench
