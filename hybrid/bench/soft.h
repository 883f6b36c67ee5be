// SPDX-License-Identifier: GPL-3.0-or-later
// `hybrid bench soft`: waves of the chain, relaxation, sessions and loading, over size, depth, slack and
// material. The thesis's own algorithm is measured in the same run.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "hybrid/bench/soft_table.h"
#include "hybrid/build/build_world.h"

namespace hybrid::bench {

const std::vector<std::string>& soft_cases();  // "wave", "relax", "session", "load"

struct SoftBenchOptions {
  bool quick = false;               // only waves up to 5 spacings, small blocks, few repeats
  std::vector<std::string> cases;   // empty: all
  std::vector<SoftEngine> engines;  // empty: all
  std::vector<double> depths;       // depths of the waves at slack 0.1, in spacings; empty: 5, 10 and 20
  double wave_s = 2.0;     // approximate time for the repeats of a wave; there are at least five repeats
  std::vector<int> sizes;  // voxels along an edge, for sessions and loads; empty: 64 and 128
  double session_s = 2.0;  // simulated time of a session
  Progress progress;
  std::function<void(const SoftRow&)> on_row;  // called for each row as soon as it is there
};

std::vector<SoftRow> bench_soft(const SoftBenchOptions& options);

// The parts of the suite. Each gives its rows to `add`.
using AddRow = std::function<void(SoftRow)>;
void bench_waves(const SoftBenchOptions& options, const std::vector<SoftEngine>& engines, const AddRow& add);
void bench_relaxation(const SoftBenchOptions& options, const std::vector<SoftEngine>& engines,
                      const AddRow& add);
void bench_sessions(const SoftBenchOptions& options, bool sessions, bool loads, const AddRow& add);

}  // namespace hybrid::bench
