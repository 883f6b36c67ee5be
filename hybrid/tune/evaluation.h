// SPDX-License-Identifier: GPL-3.0-or-later
// One session of a setting, as it is kept: its error against the truth, and its ticks.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "hybrid/tune/felt_error.h"
#include "hybrid/tune/play.h"

namespace hybrid {

struct Evaluation {
  SettingError error;
  std::vector<double> tick_us;
  double felt_p99_us = 0.0;  // of the ticks in which the truth feels something soft
  std::uint64_t memory_bytes = 0, soft_voxels = 0;
  double load_s = 0.0;
  std::vector<std::string> faults;
  std::string refused;  // why the setting cannot be built; empty: it can
};

Evaluation evaluation_of(Played played, const ForceCourse& truth, double floor_N, double dt_s);

nlohmann::json to_json(const Evaluation& evaluation);
Evaluation evaluation_from(const nlohmann::json& j);

// Percentiles of the ticks' medians over the passes, which may not be empty and have equal lengths.
Percentiles median_ticks(const std::vector<std::vector<double>>& passes);

}  // namespace hybrid
