// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/bench/threads.h"
#include "hybrid/session/relaxation_thread.h"
#include "hybrid/session/result_tape.h"
#include "hybrid/tick/tissue/async_relaxation.h"

#include <fmt/format.h>

#include <array>
#include <atomic>
#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include "device/loop/servo_timer.h"
#include "device/loop/stop_signal.h"
#include "hybrid/base/flush_to_zero.h"
#include "hybrid/base/table.h"
#include "hybrid/session/session.h"
#include "hybrid/snapshot/fill_snapshot.h"

namespace hybrid::bench {
namespace {

constexpr std::size_t kHogged = std::size_t{128} << 20U;  // bytes of each of two buffers
// Bytes copied between two calls of `meanwhile`.
constexpr std::size_t kPiece = std::size_t{1} << 20U;
constexpr double kAsOftenAsItCan_hz = 1e6;  // more often than a thread can make a surface

// Copies memory until `stop` is set. Calls `meanwhile` about every 0.1 ms.
template <class Meanwhile>
void hog_memory(const std::atomic<bool>& stop, const Meanwhile& meanwhile) {
  take_ordinary_priority();
  std::vector<char> a(kHogged, 1), b(kHogged, 2);
  for (std::size_t at = 0; !stop.load(std::memory_order_relaxed);
       at = at + kPiece == kHogged ? 0 : at + kPiece) {
    if (at == 0) a.swap(b);
    std::memcpy(a.data() + at, b.data() + at, kPiece);
    meanwhile();
  }
}

// Runs `load` on a thread beside `work`, and stops it afterwards.
template <class Load, class Work>
void run_beside(const Load& load, const Work& work) {
  std::atomic<bool> stop{false};
  std::thread thread([&] { load(stop); });
  try {
    work();
  } catch (...) {
    stop = true;
    thread.join();
    throw;
  }
  stop = true;
  thread.join();
}

// Plays another session of the scene as fast as possible, and takes its surfaces after each tick.
void relax_and_snap(const Scene& scene, BuiltScene& built, const std::atomic<bool>& stop) {
  take_ordinary_priority();
  set_flush_to_zero();
  start_async_relaxation(*built.state, Arrival::counted);
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

// Measures one scene.
class ThreadBench {
 public:
  ThreadBench(const Scene& scene, const std::string& name) : scene_(scene) {
    const std::array loads{"relaxation", "memory", "nothing relaxed"};
    for (std::size_t n = 0; n < rows_.size(); ++n) {
      rows_[n].scene = name;
      rows_[n].load = loads[n];
      rows_[n].same_ticks = n < 2;
    }
  }

  // Plays a path's length under each load, so that other load of the machine affects all of them. Progress
  // counts whole turns: a turn counts when it has ended.
  template <class Say>
  void turn(const Say& say) {
    const double done_s = seconds_[0];
    say(rows_[0].load, done_s);
    const SessionResult felt = run_relaxing();
    say("finding what is handed out", done_s);
    ResultTape tape = taped(felt);
    say(rows_[1].load, done_s);
    play(felt, tape);
    say(rows_[2].load, done_s);
    run_without_relaxation();
  }
  [[nodiscard]] double seconds() const { return seconds_[0]; }

  [[nodiscard]] std::array<ThreadsRow, 3> rows() {
    for (std::size_t n = 0; n < rows_.size(); ++n) {
      rows_[n].tick_us = times_[n].percentiles();
      rows_[n].relaxation_share = n == 0 ? relaxation_s_ / seconds_[0] : 0.0;
    }
    for (ThreadsRow& row : rows_) {
      row.p99_ratio = row.tick_us.p99 / rows_[1].tick_us.p99;
      row.p999_ratio = row.tick_us.p999 / rows_[1].tick_us.p999;
    }
    return rows_;
  }

 private:
  SessionResult run(BuiltScene& built, bool relaxes) {
    SessionOptions options;
    options.realtime = options.async_relaxation = true;
    options.keep_rows = false;
    options.keep_recording = options.relaxation_thread = relaxes;
    options.surfaces_hz = kAsOftenAsItCan_hz;
    SessionResult result = run_session(scene_, built, options);
    device::stop_if_asked();
    return result;
  }
  void add(std::size_t n, const SessionResult& result) {
    rows_[n].ticks += result.ticks;
    rows_[n].late_ticks += result.deadline_misses;
    rows_[n].results += result.async_results;
    seconds_[n] += static_cast<double>(result.ticks) * result.dt_s;
    times_[n].add(result.tick_us);
  }

  SessionResult run_relaxing() {
    BuiltScene built = build_scene(scene_), other = build_scene(scene_);
    SessionResult result;
    run_beside([&](const std::atomic<bool>& stop) { relax_and_snap(scene_, other, stop); },
               [&] { result = run(built, true); });
    add(0, result);
    relaxation_s_ += result.relaxation_s;
    return result;
  }

  void run_without_relaxation() {
    BuiltScene built = build_scene(scene_);
    run_beside([](const std::atomic<bool>& stop) { hog_memory(stop, [] {}); },
               [&] { add(2, run(built, false)); });
  }

  // Plays the session again as fast as possible. Relaxation is computed in the tick, and its results are
  // kept.
  ResultTape taped(const SessionResult& felt) {
    const ScopedFlushToZero flushed;
    BuiltScene built = build_scene(scene_);
    ResultTape tape(built.state->soft.size());
    begin_session(scene_, *built.world, *built.state, felt.start_m);
    start_async_relaxation(*built.state, Arrival::recorded);
    for (const RecordedTick& tick : felt.recording) {
      tick_again(built, tick);
      tape.keep(built.state->async);
    }
    return tape;
  }

  // Plays the session again in real time, while another thread hands out the results on `tape`.
  void play(const SessionResult& felt, ResultTape& tape) {
    const ScopedFlushToZero flushed;
    BuiltScene built = build_scene(scene_);
    begin_session(scene_, *built.world, *built.state, felt.start_m);
    start_async_relaxation(*built.state, Arrival::played);
    AsyncRelaxation& apart = built.state->async;
    run_beside([&](const std::atomic<bool>& stop) { hog_memory(stop, [&] { tape.hand_out(apart); }); },
               [&] {
                 SessionResult played;
                 played.dt_s = felt.dt_s;
                 device::ServoTimer timer(felt.dt_s);
                 timer.raise_priority();
                 std::uint64_t hash = kHashBegin;
                 for (const RecordedTick& tick : felt.recording) {
                   device::stop_if_asked();
                   timer.wait();
                   restore_tick_timing(tick, *built.state);
                   while (!ResultTape::ready(apart)) std::this_thread::yield();
                   const TickResult again = tick_again(built, tick);
                   hash = hash_tick(hash, again);
                   played.tick_us.add(again.tick_us);
                   ++played.ticks;
                 }
                 played.deadline_misses = timer.missed();
                 played.async_results = apart.results;
                 rows_[1].same_ticks = rows_[1].same_ticks && hash == felt.recording.back().hash;
                 add(1, played);
               });
  }

  TickResult tick_again(BuiltScene& built, const RecordedTick& tick) const {
    restore_tick_timing(tick, *built.state);
    return haptic_tick(*built.world, *built.state, {.position_m = tick.device_m, .fault = tick.fault},
                       1.0 / scene_.rate_hz);
  }

  const Scene& scene_;
  std::array<ThreadsRow, 3> rows_;
  std::array<LatencyHistogram, 3> times_;
  std::array<double, 3> seconds_{};
  double relaxation_s_ = 0.0;
};

}  // namespace

std::vector<ThreadsRow> bench_threads(const ThreadsBenchOptions& options) {
  std::vector<ThreadsRow> rows;
  for (const auto& file : options.scenes) {
    const Scene scene = load_scene(file);
    const std::string name =
        file.filename() == "scene.toml" ? file.parent_path().filename().string() : file.stem().string();
    ThreadBench bench(scene, name);
    while (bench.seconds() < options.seconds) {
      bench.turn([&](const std::string& load, double seconds) {
        if (options.progress)
          options.progress(fmt::format("{}, {}: {:.3g} of {:.3g} s", name, load, seconds, options.seconds));
      });
    }
    for (ThreadsRow& row : bench.rows()) rows.push_back(std::move(row));
  }
  return rows;
}

std::string threads_table(const std::vector<ThreadsRow>& rows) {
  const auto time = [](double Percentiles::*which) {
    return [which](const ThreadsRow& r) { return fmt::format("{:.0f}", r.tick_us.*which); };
  };
  const auto ratio = [](double ThreadsRow::*which) {
    return [which](const ThreadsRow& r) { return fmt::format("{:.2f}", r.*which); };
  };
  const Table<ThreadsRow> table({
      {{"scene"}, 16, Side::left, [](const ThreadsRow& r) { return r.scene; }},
      {{"load"}, 15, Side::left, [](const ThreadsRow& r) { return r.load; }},
      {{"ticks"}, 8, Side::right, [](const ThreadsRow& r) { return std::to_string(r.ticks); }},
      {{"p50"}, 7, Side::right, time(&Percentiles::p50)},
      {{"p99"}, 7, Side::right, time(&Percentiles::p99)},
      {{"p99.9"}, 7, Side::right, time(&Percentiles::p999)},
      {{"max"}, 8, Side::right, time(&Percentiles::max)},
      {{"p99 ratio"}, 10, Side::right, ratio(&ThreadsRow::p99_ratio)},
      {{"p99.9 ratio"}, 11, Side::right, ratio(&ThreadsRow::p999_ratio)},
      {{"late"}, 6, Side::right, [](const ThreadsRow& r) { return std::to_string(r.late_ticks); }},
      {{"results"}, 8, Side::right, [](const ThreadsRow& r) { return std::to_string(r.results); }},
      {{"same"}, 5, Side::right, [](const ThreadsRow& r) { return r.same_ticks ? "yes" : "no"; }},
  });
  return table.text(rows);
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
          {"relaxation_share", row.relaxation_share},
          {"same_ticks", row.same_ticks}};
}

}  // namespace hybrid::bench
