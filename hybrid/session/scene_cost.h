// SPDX-License-Identifier: GPL-3.0-or-later
// The cost of a session of a scene, measured on short samples of the scene's path.
#pragma once

#include <cstdint>
#include <optional>

#include "hybrid/session/session.h"

namespace hybrid {

struct SceneCost {
  double load_s = 0.0;
  std::uint64_t held_bytes = 0;  // memory of the program once the scene is loaded
  // Estimated memory of the soft objects once they have been touched everywhere.
  std::uint64_t touched_bytes = 0;
  int places = 0;                      // places of contact along the path at which ticks were measured
  std::uint64_t ticks = 0;             // measured ticks in contact
  std::optional<Percentiles> tick_us;  // of the measured ticks; empty if the path touches nothing
  double period_us = 0.0;
};

// Measures at up to four places at which the path comes near an object, spread over the path. At each the
// simulated hand runs for a quarter of a second on a copy of the state. `built` is not changed.
SceneCost measure_cost(const Scene& scene, const BuiltScene& built);

// For example "… tick p50 120, p99 480 us of 1000, over 812 ticks at 4 places of contact".
std::string in_words(const SceneCost& cost);

}  // namespace hybrid
