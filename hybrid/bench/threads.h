// SPDX-License-Identifier: GPL-3.0-or-later
// `hybrid bench threads`: cost of the servo thread's ticks while relaxation and snapshots use the other
// cores. The same ticks are also timed while the other cores run unrelated work that only moves memory. The
// results of both are equal to the last bit.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "hybrid/base/histogram.h"
#include "hybrid/build/build_world.h"

namespace hybrid::bench {

struct ThreadsBenchOptions {
  std::vector<std::filesystem::path> scenes;
  double seconds = 60.0;  // real time of each load in each scene, in turns of a path's length
  Progress progress;
};

// One scene under one load.
struct ThreadsRow {
  std::string scene, load;                               // "relaxation", "memory" or "nothing relaxed"
  std::uint64_t ticks = 0, late_ticks = 0, results = 0;  // results: of relaxation, applied by ticks
  Percentiles tick_us;                                   // processor time of the servo thread
  double p99_ratio = 0.0, p999_ratio = 0.0;              // relative to the same scene under `memory`
  double relaxation_share = 0.0;                         // share of the time that the relaxation thread works
  // Do the ticks have the same hash as those under `relaxation`?
  bool same_ticks = true;
};

// Loads, in turns:
//   relaxation       the session's relaxation thread, which also publishes surfaces as often as it can. A
//                    further thread relaxes another session of the scene without a pause, and takes its
//                    surfaces.
//   memory           the session under `relaxation` is played again with its inputs, while a thread copies
//                    256 MB between two buffers. Each tick gets the same asynchronous results as under
//                    `relaxation`. The copying thread writes them, so here too they come from another core.
//   nothing relaxed  as `memory`, but no result ever arrives: the cost of ticks that have less to do.
// Throws SceneError.
std::vector<ThreadsRow> bench_threads(const ThreadsBenchOptions& options);

std::string threads_table(const std::vector<ThreadsRow>& rows);
nlohmann::ordered_json to_json(const ThreadsRow& row);

}  // namespace hybrid::bench
