// SPDX-License-Identifier: GPL-3.0-or-later
// One voxel of a block's top is moved, straight down or obliquely, and the chain follows.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "hybrid/bench/soft.h"
#include "hybrid/bench/soft_engines.h"
#include "hybrid/session/session.h"

namespace hybrid::bench {
namespace {

struct Wave {
  std::string material;
  double depth = 0.0, slack = 0.1;  // unit: spacing
  int axes = 1;                     // 1: down; 3: equally far along x, y and z
};

struct TimedEngine {
  SoftEngine name;
  std::unique_ptr<WaveEngine> does;
  std::vector<double> us;
};

// Turns of product and baseline, and counted runs in a turn (tests/README.md).
constexpr std::size_t kLeastTurns = 1, kMostTurns = 20, kRunsInTurn = 5;

std::vector<TimedEngine> engines_of(const std::vector<SoftEngine>& names) {
  std::vector<TimedEngine> engines;
  engines.reserve(names.size());
  for (const SoftEngine name : names) engines.push_back({name, make_wave_engine(name), {}});
  return engines;
}

// The size of a block in which the octahedron of a wave just fits, so that no side and no anchor cuts it.
std::array<int, 3> dims_for(const Wave& wave) {
  const int reach = static_cast<int>(std::ceil(wave.depth / wave.slack)) + 1;
  return {2 * reach + 1, 2 * reach + 1, reach + 2};
}

Push push_of(const Wave& wave, const std::array<int, 3>& dims) {
  const auto by = static_cast<float>(wave.depth * kSoftSpacing_m);
  return {.sources = {{dims[0] / 2, dims[1] / 2, dims[2] - 1}},
          .moves = {wave.axes == 3 ? glm::vec3(by, by, -by) : glm::vec3(0.0F, 0.0F, -by)}};
}

SoftRow row_of(const Wave& wave, TimedEngine& engine, const voxel::LabelVolume& volume,
               const voxel::LatticeOptions& options) {
  SoftRow row{.test_case = "wave",
              .engine = engine.name,
              .voxels = volume.voxel_count(),
              .material = wave.material,
              .depth_spacings = wave.depth,
              .slack = wave.slack,
              .axes = wave.axes};
  const WaveState state =
      look_at(*engine.does, volume, options, push_of(wave, volume.dims), wave.depth / wave.slack);
  row.exact = state.exact();
  row.source_off_spacings = state.source_off_m / kSoftSpacing_m;
  row.moved = state.moved;
  row.violated = state.violated;
  row.repeats = engine.us.size();
  if (engine.name == SoftEngine::classic && engine.does->candidates() > 0) {
    std::vector<double> us = engine.us;
    row.ns_per_candidate = 1e3 * percentiles(us).p50 / static_cast<double>(engine.does->candidates());
  }
  row.time_us = percentiles(engine.us);
  if (state.moved > 0) row.ns_per_voxel_update = 1e3 * row.time_us->p50 / static_cast<double>(state.moved);
  row.bytes_per_voxel = static_cast<double>(engine.does->bytes()) / static_cast<double>(row.voxels);
  return row;
}

void add_with_speedup(std::vector<SoftRow> rows, const AddRow& add) {
  const auto classic = std::find_if(rows.begin(), rows.end(),
                                    [](const SoftRow& row) { return row.engine == SoftEngine::classic; });
  if (classic != rows.end()) {
    const double p50 = classic->time_us->p50;
    for (SoftRow& row : rows) {
      if (row.engine != SoftEngine::classic && row.time_us->p50 > 0.0) row.speedup = p50 / row.time_us->p50;
    }
  }
  for (SoftRow& row : rows) add(std::move(row));
}

// Runs each engine from rest, in turns, so that other load of the machine affects all alike. The first run of
// a turn does not count, because the caches still hold the data of the other engine. Writing these cache
// lines back to memory takes half of the time of a wave ten spacings deep.
void run_wave(const Wave& wave, std::vector<TimedEngine>& engines, const voxel::LabelVolume& volume,
              const voxel::LatticeOptions& options, double most_us, const AddRow& add) {
  double spent_us = 0.0;
  for (TimedEngine& engine : engines) {
    engine.does->prepare(volume, options, push_of(wave, volume.dims));
    engine.us.clear();
  }
  for (std::size_t turn = 0; turn < kMostTurns && (turn < kLeastTurns || spent_us < most_us); ++turn) {
    for (std::size_t e = 0; e < engines.size(); ++e) {
      TimedEngine& engine = engines[(turn + e) % engines.size()];
      for (std::size_t n = 0; n <= kRunsInTurn; ++n) {
        engine.does->rest();
        const double us = engine.does->run_us();
        if (n > 0) engine.us.push_back(us);
        spent_us += us;
      }
    }
  }
  std::vector<SoftRow> rows;
  rows.reserve(engines.size());
  for (TimedEngine& engine : engines) rows.push_back(row_of(wave, engine, volume, options));
  add_with_speedup(std::move(rows), add);
}

// The published comparison: 50 voxels along an edge, and one voxel of the top pushed a hundred times by a
// tenth of a spacing. The slack is chosen to displace 25,234 voxels, as published. The time of a push is the
// median over the rounds.
void run_pushes(std::vector<TimedEngine>& engines, int rounds, const AddRow& add) {
  constexpr int pushes = 100, edge = 50;
  const Wave wave{.material = "homogeneous", .depth = 10.0, .slack = 0.3};
  const voxel::LabelVolume volume = wave_volume(wave.material, {edge, edge, edge});
  const voxel::LatticeOptions options = wave_options(wave.material, wave.slack);
  Push push = push_of(wave, volume.dims);
  push.moves.front() /= static_cast<float>(pushes);
  std::vector<std::vector<std::vector<double>>> us(engines.size(), std::vector<std::vector<double>>(pushes));
  for (TimedEngine& engine : engines) engine.does->prepare(volume, options, push);
  for (int round = -1; round < rounds; ++round) {  // the first round is a warm-up
    for (std::size_t e = 0; e < engines.size(); ++e) {
      engines[e].does->rest();
      for (auto& times : us[e]) {
        const double time = engines[e].does->run_us();
        if (round >= 0) times.push_back(time);
      }
    }
  }
  std::vector<SoftRow> rows;
  for (std::size_t e = 0; e < engines.size(); ++e) {
    engines[e].us.clear();
    for (auto& times : us[e]) engines[e].us.push_back(percentiles(times).p50);
    SoftRow row = row_of(wave, engines[e], volume, options);
    row.ns_per_candidate.reset();
    row.ns_per_voxel_update.reset();
    row.repeats = static_cast<std::size_t>(rounds);
    row.note = "100 pushes of 0.1";
    rows.push_back(std::move(row));
  }
  add_with_speedup(std::move(rows), add);
}

// The thesis's study: the same deformation of materials of different stiffness. Only depth / slack matters.
std::vector<Wave> study(bool quick) {
  std::vector<Wave> waves;
  for (const double slack : {0.1, 0.2, 0.4}) {
    for (const double depth : {1.0, 2.5, 5.0, 10.0, 20.0}) {
      const double ratio = depth / slack;
      if (ratio < 5.0 || ratio > (quick ? 30.0 : 60.0) || (slack == 0.1 && depth == 5.0)) continue;
      waves.push_back({.material = "homogeneous", .depth = depth, .slack = slack});
    }
  }
  return waves;
}

}  // namespace

void bench_waves(const SoftBenchOptions& options, const std::vector<SoftEngine>& names, const AddRow& add) {
  std::vector<TimedEngine> engines = engines_of(names);
  const auto tell = [&options](const Wave& w) {
    if (options.progress)
      options.progress(fmt::format("a wave {:g} spacings deep at slack {:g} through {}, {} axes", w.depth,
                                   w.slack, w.material, w.axes));
  };
  std::vector<double> depths = options.depths;
  if (depths.empty()) depths = options.quick ? std::vector{5.0} : std::vector{5.0, 10.0, 20.0};
  for (const double depth : depths) {
    for (const std::string& material : wave_materials()) {
      const Wave shape{.material = material, .depth = depth};
      const voxel::LabelVolume volume = wave_volume(material, dims_for(shape));
      const voxel::LatticeOptions limits = wave_options(material, shape.slack);
      for (const int axes : {1, 3}) {
        const Wave wave{.material = material, .depth = depth, .axes = axes};
        tell(wave);
        run_wave(wave, engines, volume, limits, 1e6 * options.wave_s, add);
      }
    }
  }
  for (const Wave& wave : study(options.quick)) {
    tell(wave);
    run_wave(wave, engines, wave_volume(wave.material, dims_for(wave)),
             wave_options(wave.material, wave.slack), 1e6 * options.wave_s, add);
  }
  if (options.progress) options.progress("100 pushes of a tenth of a spacing into 50 voxels an edge");
  run_pushes(engines, options.quick ? 3 : 15, add);
}

}  // namespace hybrid::bench
