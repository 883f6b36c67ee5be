// SPDX-License-Identifier: GPL-3.0-or-later
// `hybrid bench soft`: waves of the chain, relaxation, sessions and loading, by size, depth, slack and
// material, with the thesis's own algorithm in the same run.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "hybrid/bench/soft_table.h"
#include "hybrid/build/build_world.h"

namespace hybrid::bench {

const std::vector<std::string>& soft_cases();  // wave, relax, session, load

struct SoftBenchOptions {
  bool quick = false;               // waves up to 5 spacings, small blocks, few repeats
  std::vector<std::string> cases;   // empty: all
  std::vector<SoftEngine> engines;  // empty: all
  std::vector<double> depths;       // of the waves at slack 0.1, in spacings; empty: 5, 10 and 20
  double wave_s = 2.0;              // spent on repeating one wave, about; at least five times
  std::vector<int> sizes;           // voxels an edge, of sessions and loads; empty: 64 and 128
  double session_s = 2.0;           // of simulated time
  Progress progress;
  std::function<void(const SoftRow&)> on_row;  // as soon as there is one
};

std::vector<SoftRow> bench_soft(const SoftBenchOptions& options);

// The parts; each hands its rows to `add`.
using AddRow = std::function<void(SoftRow)>;
void bench_waves(const SoftBenchOptions& options, const std::vector<SoftEngine>& engines, const AddRow& add);
void bench_relaxation(const SoftBenchOptions& options, const std::vector<SoftEngine>& engines,
                      const AddRow& add);
void bench_sessions(const SoftBenchOptions& options, bool sessions, bool loads, const AddRow& add);

}  // namespace hybrid::bench
