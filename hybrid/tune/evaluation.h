// SPDX-License-Identifier: GPL-3.0-or-later
// One session with a setting, as the cache stores it: its error against the truth, and the times of its
// ticks.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "hybrid/tune/felt_error.h"
#include "hybrid/tune/play.h"

namespace hybrid {

struct Evaluation {
  // error: over the ticks in which something soft is felt. With another coupling it is over all ticks with a
  // force, and at_soft over those in which something soft is felt.
  SettingError error, at_soft;
  std::vector<double> tick_us;
  double felt_p99_us = 0.0;  // p99 over the ticks in which the truth feels something soft
  std::uint64_t memory_bytes = 0, soft_voxels = 0;
  double load_s = 0.0;
  bool on_patches = false;  // an object is on nested patches
  std::vector<std::string> faults;
  std::string refused;  // why the setting cannot be built; empty if it can be built
};

// `other_coupling`: the session had another coupling than the truth, which changes the force at rigid
// objects, too.
Evaluation evaluation_of(Played played, const ForceCourse& truth, double floor_N, double dt_s,
                         bool other_coupling);

nlohmann::json to_json(const Evaluation& evaluation);
Evaluation evaluation_from(const nlohmann::json& j);

// Percentiles over the ticks. The time of a tick is its median over the passes. There must be at least one
// pass, and all passes must have the same length.
Percentiles median_ticks(const std::vector<std::vector<double>>& passes);

}  // namespace hybrid
