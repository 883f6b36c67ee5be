// SPDX-License-Identifier: GPL-3.0-or-later
// `hybrid bench threads`: what the servo thread's ticks cost it while relaxation and snapshots have the other
// cores, beside what the same ticks, to the last bit, cost while something that knows nothing of them, and
// only moves memory, has these.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "hybrid/build/build_world.h"
#include "hybrid/base/histogram.h"

namespace hybrid::bench {

struct ThreadsBenchOptions {
  std::vector<std::filesystem::path> scenes;
  double seconds = 60.0;  // of real time, of each load in each scene, in turns of a path's length
  Progress progress;
};

// Of a scene under one load.
struct ThreadsRow {
  std::string scene, load;                               // relaxation, memory, nothing relaxed
  std::uint64_t ticks = 0, late_ticks = 0, results = 0;  // results: of relaxation, that ticks took
  Percentiles tick_us;                                   // the servo thread's own processor time
  double p99_ratio = 0.0, p999_ratio = 0.0;              // to the same scene's under `memory`
  double relaxation_share = 0.0;                         // of the time, of its thread
  bool same_ticks = true;                                // as under `relaxation`, by their hash
};

// Loads, in turns:
//   relaxation       the session's relaxation thread, which also says where surfaces are as often as it can,
//                    and another session of the scene that is relaxed and snapped without a pause;
//   memory           in place of all that a thread that copies 256 MB to and fro. The session before is felt
//                    again, with its inputs; what was found apart then is handed to the ticks that took it,
//                    by that thread, so that another core wrote it here, too;
//   nothing relaxed  as `memory`, and no result ever comes: what ticks cost that have less to do.
// Throws SceneError.
std::vector<ThreadsRow> bench_threads(const ThreadsBenchOptions& options);

std::string threads_table(const std::vector<ThreadsRow>& rows);
nlohmann::ordered_json to_json(const ThreadsRow& row);

}  // namespace hybrid::bench
