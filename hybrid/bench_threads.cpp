// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/bench_threads.h"

#include <fmt/format.h>

#include <array>
#include <atomic>
#include <cstring>
#include <memory>
#include <thread>

#include "hybrid/denormals.h"
#include "hybrid/fill_snapshot.h"
#include "hybrid/session.h"

namespace hybrid::bench {
namespace {

constexpr std::size_t kHogged = std::size_t{128} << 20U;  // bytes, of each of two
constexpr double kAsOftenAsItCan_hz = 1e6;

// Copies memory until it is told to stop.
void hog_memory(const std::atomic<bool>& stop) {
  take_ordinary_priority();
  std::vector<char> a(kHogged, 1), b(kHogged, 2);
  while (!stop.load(std::memory_order_relaxed)) {
    std::memcpy(a.data(), b.data(), kHogged);
    std::memcpy(b.data(), a.data(), kHogged);
  }
}

// Another session of the scene, as fast as it goes, its surfaces taken after each tick.
void relax_and_snap(const Scene& scene, BuiltScene& built, const std::atomic<bool>& stop) {
  take_ordinary_priority();
  flush_denormals();
  relax_apart(*built.state, Arrival::counted);
  Snapshot snapshot;
  while (!stop.load(std::memory_order_relaxed)) {
    const auto device = scene_device(scene, scene_path(scene));
    begin_session(scene, *built.world, *built.state, device->read().position_m);
    const double dt_s = 1.0 / scene.rate_hz;
    const double length_s = scene_path(scene)->duration_s();
    for (double t = 0.0; t < length_s && !stop.load(std::memory_order_relaxed); t += dt_s) {
      const TickResult felt = haptic_tick(*built.world, *built.state, device->read(), dt_s);
      device->write(felt.force_N, dt_s);
      fill_moved(*built.world, *built.state, snapshot);
    }
  }
}

// One path's length under a load.
void run_once(const Scene& scene, ThreadsRow& row, TimeSpread& all, double& relaxation_s, double& seconds) {
  const bool relaxes = row.load == "relaxation";
  BuiltScene built = build_scene(scene);
  BuiltScene other = relaxes ? build_scene(scene) : BuiltScene{};
  std::atomic<bool> stop{false};
  std::thread load([&] { relaxes ? relax_and_snap(scene, other, stop) : hog_memory(stop); });
  SessionOptions options;
  options.realtime = options.relax_apart = true;
  options.keep_rows = options.keep_recording = false;
  options.relaxation_thread = relaxes;
  options.surfaces_hz = kAsOftenAsItCan_hz;
  SessionResult result;
  try {
    result = run_session(scene, built, options);
  } catch (...) {
    stop = true;
    load.join();
    throw;
  }
  stop = true;
  load.join();
  row.ticks += result.ticks;
  row.late_ticks += result.deadline_misses;
  row.results += result.relaxed_apart;
  relaxation_s += result.relaxation_s;
  seconds += static_cast<double>(result.ticks) * result.dt_s;
  all.add(result.tick_us);
}

}  // namespace

std::vector<ThreadsRow> bench_threads(const ThreadsBenchOptions& options) {
  std::vector<ThreadsRow> rows;
  for (const auto& file : options.scenes) {
    const Scene scene = load_scene(file);
    std::array<ThreadsRow, 2> pair;
    std::array<TimeSpread, 2> all;
    std::array<double, 2> relaxation_s{}, seconds{};
    pair[0].load = "relaxation";
    pair[1].load = "memory";
    // In turns, so that what else the machine does comes to both.
    while (seconds[1] < options.seconds) {
      for (std::size_t n = 0; n < 2; ++n) {
        pair[n].scene =
            file.filename() == "scene.toml" ? file.parent_path().filename().string() : file.stem().string();
        if (options.progress)
          options.progress(fmt::format("{}, load {}: {:.0f} of {:.0f} s", pair[n].scene, pair[n].load,
                                       seconds[n], options.seconds));
        run_once(scene, pair[n], all[n], relaxation_s[n], seconds[n]);
      }
    }
    for (std::size_t n = 0; n < 2; ++n) {
      pair[n].tick_us = all[n].percentiles();
      pair[n].relaxation_share = relaxation_s[n] / seconds[n];
    }
    for (ThreadsRow& row : pair) {
      row.p99_ratio = row.tick_us.p99 / pair[1].tick_us.p99;
      row.p999_ratio = row.tick_us.p999 / pair[1].tick_us.p999;
      rows.push_back(row);
    }
  }
  return rows;
}

std::string threads_table(const std::vector<ThreadsRow>& rows) {
  std::string text =
      fmt::format("{:<16} {:<11} {:>8} {:>7} {:>7} {:>7} {:>8} {:>10} {:>11} {:>6} {:>8}\n", "scene", "load",
                  "ticks", "p50", "p99", "p99.9", "max", "p99 ratio", "p99.9 ratio", "late", "results");
  for (const ThreadsRow& r : rows) {
    text += fmt::format(
        "{:<16} {:<11} {:>8} {:>7.0f} {:>7.0f} {:>7.0f} {:>8.0f} {:>10.2f} {:>11.2f} {:>6} {:>8}\n", r.scene,
        r.load, r.ticks, r.tick_us.p50, r.tick_us.p99, r.tick_us.p999, r.tick_us.max, r.p99_ratio,
        r.p999_ratio, r.late_ticks, r.results);
  }
  return text;
}

nlohmann::ordered_json to_json(const ThreadsRow& row) {
  return {{"scene", row.scene},
          {"load", row.load},
          {"ticks", row.ticks},
          {"late_ticks", row.late_ticks},
          {"results", row.results},
          {"tick_us",
           {{"p50", row.tick_us.p50},
            {"p99", row.tick_us.p99},
            {"p999", row.tick_us.p999},
            {"max", row.tick_us.max}}},
          {"p99_ratio", row.p99_ratio},
          {"p999_ratio", row.p999_ratio},
          {"relaxation_share", row.relaxation_share}};
}

}  // namespace hybrid::bench
