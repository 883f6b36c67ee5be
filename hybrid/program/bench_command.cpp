// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "device/loop/stop_signal.h"
#include "hybrid/bench/convergence_plot.h"
#include "hybrid/bench/occupancy.h"
#include "hybrid/bench/occupancy_plot.h"
#include "hybrid/bench/rigid.h"
#include "hybrid/bench/scenes/bench_scenes.h"
#include "hybrid/bench/soft.h"
#include "hybrid/bench/thesis/thesis_study.h"
#include "hybrid/bench/threads.h"
#include "hybrid/program/commands.h"
#include "hybrid/program/report_page.h"
#include "hybrid/session/outputs.h"
#include "hybrid/session/report.h"

namespace hybrid {
namespace {

constexpr int kSettlingRounds = 60;    // rounds of relaxation in the plot
constexpr int kQuickSceneRepeats = 3;  // timed sessions of a scene with --quick

std::vector<bench::Engine> engines_of(const std::vector<std::string>& names) {
  std::vector<bench::Engine> engines;
  for (const bench::Engine engine : bench::kEngines) {
    if (std::find(names.begin(), names.end(), bench::engine_name(engine)) != names.end())
      engines.push_back(engine);
  }
  return engines;
}

// The results of the product itself in one line.
std::string summary(const std::vector<bench::RigidRow>& rows) {
  std::size_t runs = 0, inside = 0, pops = 0, lost = 0;
  double worst = 0.0;
  for (const bench::RigidRow& row : rows) {
    if (row.engine != bench::Engine::hybrid) continue;
    ++runs;
    inside += row.judged.inside_ticks.value_or(0);
    pops += row.judged.pop_throughs.value_or(0);
    lost += row.judged.lost_ticks;
    if (row.judged.error_mesh_max) worst = std::max(worst, *row.judged.error_mesh_max / row.scale);
  }
  if (runs == 0) return {};
  return fmt::format(
      "hybrid, {} runs: {} ticks inside, {} times popped through; error against the mesh at most {:.3g} um "
      "(in a scene of size 1; of a file at its own size), {} ticks without an optimum nearby\n",
      runs, inside, pops, 1e6 * worst, lost);
}

// The chosen names that the suite has.
std::vector<std::string> chosen_in_suite(const std::vector<std::string>& chosen,
                                         const std::vector<std::string>& suite) {
  std::vector<std::string> result;
  for (const std::string& name : chosen) {
    if (std::find(suite.begin(), suite.end(), name) != suite.end()) result.push_back(name);
  }
  return result;
}

void rigid_suite(const BenchCommand& command, std::FILE* words, nlohmann::ordered_json& json) {
  bench::RigidBenchOptions options{.quick = command.quick,
                                   .every_tick = command.every_tick,
                                   .paths = chosen_in_suite(command.only, bench::rigid_paths()),
                                   .meshes = command.meshes,
                                   .mesh_unit_m = command.mesh_unit_m,
                                   .engines = engines_of(command.engines),
                                   .trace = command.trace,
                                   .progress = progress_on_terminal(),
                                   .on_note = {},
                                   .on_row = {}};
  options.on_note = [](const std::string& note) {
    end_progress();
    fmt::print(stderr, "note: {}\n", note);
  };
  options.on_row = [words, &json](const bench::RigidRow& row) {
    end_progress();
    json.push_back(bench::to_json(row));
    fmt::print(words, "{}", bench::table_line(row));
    std::fflush(words);
    device::stop_if_asked();
  };
  fmt::print(words,
             "times in us, lengths in um (u) or mm (m), build in ms; 'mesh err' is the distance to the exact "
             "optimum on the mesh, at so many ticks\n{}",
             bench::table_head());
  const std::vector<bench::RigidRow> rows = bench::bench_rigid(options);
  end_progress();
  fmt::print(words, "\n{}", summary(rows));
  if (!rows.empty())
    fmt::print(words, "an empty measurement shows {:.3f} us, which is in every time above\n",
               rows.front().timer_overhead_us);
  if (const std::string ratios = bench::ratio_table(rows); !ratios.empty())
    fmt::print(
        words,
        "\nhybrid's own times, and how many times as long the others took (* over a part of the path):\n{}",
        ratios);
}

// `growth`: gets the growth of work with relative deformation.
void soft_suite(const BenchCommand& command, std::FILE* words, Outputs& outputs, nlohmann::ordered_json& json,
                nlohmann::ordered_json& growth) {
  bench::SoftBenchOptions options{.quick = command.quick,
                                  .cases = chosen_in_suite(command.only, bench::soft_cases()),
                                  .engines = {},
                                  .depths = {},
                                  .sizes = command.sizes,
                                  .progress = progress_on_terminal(),
                                  .on_row = {}};
  if (command.session_s) options.session_s = *command.session_s;
  for (const bench::SoftEngine engine : bench::kSoftEngines) {
    if (!chosen_in_suite(command.engines, {bench::engine_name(engine)}).empty())
      options.engines.push_back(engine);
  }
  options.on_row = [words, &json](const bench::SoftRow& row) {
    end_progress();
    json.push_back(bench::to_json(row));
    fmt::print(words, "{}", bench::soft_table_line(row));
    std::fflush(words);
    device::stop_if_asked();
  };
  fmt::print(words, "times in us, depth and slack in spacings; 'viol' are links beyond their limits\n{}",
             bench::soft_table_head());
  const std::vector<bench::SoftRow> rows = bench::bench_soft(options);
  end_progress();
  if (const auto found = bench::growth_of(rows)) {
    fmt::print(words, "\n{}", bench::in_words(*found));
    growth = bench::to_json(*found);
  }
  outputs.write("plot", command.plot, [](const std::filesystem::path& file) {
    save_settling_plot(file, bench::measure_settling(kSettlingRounds));
  });
}

// The file of the suite's plot. With all suites its name gets the suite's name, because several suites write
// a plot.
std::filesystem::path occupancy_plot(const BenchCommand& command) {
  if (command.plot.empty() || command.suite != "all") return command.plot;
  std::filesystem::path plot = command.plot;
  return plot.replace_filename(plot.stem().string() + "-occupancy" + plot.extension().string());
}

void occupancy_suite(const BenchCommand& command, std::FILE* words, Outputs& outputs,
                     nlohmann::ordered_json& json) {
  bench::OccupancyBenchOptions options{.quick = command.quick,
                                       .cases = chosen_in_suite(command.only, bench::occupancy_cases()),
                                       .engines = {},
                                       .cells = command.cells,
                                       .progress = progress_on_terminal(),
                                       .on_row = {}};
  for (const bench::OccupancyEngine engine : bench::kOccupancyEngines) {
    if (!chosen_in_suite(command.engines, {bench::engine_name(engine)}).empty())
      options.engines.push_back(engine);
  }
  options.on_row = [words, &json](const bench::OccupancyRow& row) {
    end_progress();
    json.push_back(bench::to_json(row));
    fmt::print(words, "{}", bench::occupancy_table_line(row));
    std::fflush(words);
    device::stop_if_asked();
  };
  fmt::print(
      words,
      "times in ns (k us, M ms), each the mean over 64 operations, but of brute force's look-ups, of "
      "rebuilds and of the tree's updates, which are timed alone; 'box' in cells an edge; 'extra' is what "
      "lies within a cell of the box\n{}",
      bench::occupancy_table_head());
  const std::vector<bench::OccupancyRow> rows = bench::bench_occupancy(options);
  end_progress();
  fmt::print(words, "\n{}", bench::occupancy_summary(rows));
  outputs.write("plot", occupancy_plot(command),
                [&rows](const std::filesystem::path& file) { save_occupancy_plot(file, rows); });
}

void threads_suite(const BenchCommand& command, std::FILE* words, nlohmann::ordered_json& json) {
  bench::ThreadsBenchOptions options{.scenes = command.scenes, .progress = progress_on_terminal()};
  if (command.session_s) options.seconds = *command.session_s;
  const std::vector<bench::ThreadsRow> rows = bench::bench_threads(options);
  end_progress();
  fmt::print(words,
             "the servo thread's own processor time, in us, while the other cores relax and snap, and while "
             "they copy memory\n{}",
             bench::threads_table(rows));
  for (const bench::ThreadsRow& row : rows) json.push_back(bench::to_json(row));
}

// If the command names no scenes, runs the scenes that come with the program.
void scenes_suite(const BenchCommand& command, std::FILE* words, nlohmann::ordered_json& json) {
  bench::ScenesBenchOptions options{.scenes = command.scenes, .progress = progress_on_terminal()};
  if (options.scenes.empty()) options.scenes = bench::shipped_scenes();
  if (command.quick) options.repeats = kQuickSceneRepeats;
  options.on_row = [words, &json](const bench::SceneRow& row) {
    end_progress();
    json.push_back(bench::to_json(row));
    fmt::print(words, "{}", bench::scenes_table_line(row));
    std::fflush(words);
  };
  fmt::print(words, "whole scenes along their paths, on an ideal device\n{}", bench::scenes_table_head());
  const std::vector<bench::SceneRow> rows = bench::bench_scenes(options);
  end_progress();
  fmt::print(words, "\n{}", bench::scenes_summary(rows));
}

// `report`: the whole report, for the head of the page.
void thesis_suite(const BenchCommand& command, std::FILE* words, Outputs& outputs,
                  const nlohmann::ordered_json& report, nlohmann::ordered_json& json) {
  const bench::ThesisStudy study =
      bench::study_thesis({.quick = command.quick, .progress = progress_on_terminal()});
  end_progress();
  for (const auto& row : study.cubes) json.push_back(bench::to_json(row));
  for (const auto& row : study.pair) json.push_back(bench::to_json(row));
  for (const auto& row : study.threads) json.push_back(bench::to_json(row));
  fmt::print(words, "{}", bench::thesis_table(study));
  if (command.report.folder.empty()) return;
  nlohmann::ordered_json of_page = report;
  of_page["suites"] = {{"thesis", json}};
  write_report(outputs, command.report, bench::thesis_page(study), of_page);
}

template <class Engines>
std::vector<std::string> names_of(const Engines& engines) {
  std::vector<std::string> names;
  names.reserve(std::size(engines));
  for (const auto engine : engines) names.emplace_back(bench::engine_name(engine));
  return names;
}

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

// The names that may be chosen in a suite: its parts and its engines.
struct SuiteNames {
  std::string suite;
  std::vector<std::string> parts, engines;
};
std::vector<SuiteNames> suite_names() {
  return {{"rigid", bench::rigid_paths(), names_of(bench::kEngines)},
          {"soft", bench::soft_cases(), names_of(bench::kSoftEngines)},
          {"occupancy", bench::occupancy_cases(), names_of(bench::kOccupancyEngines)}};
}

// The suites that run. In "all" a suite is left out if every chosen name belongs to other suites.
std::vector<SuiteNames> running_suites(const BenchCommand& command) {
  const auto has_any = [](const std::vector<std::string>& chosen, const std::vector<std::string>& names) {
    return chosen.empty() || !chosen_in_suite(chosen, names).empty();
  };
  std::vector<SuiteNames> running = suite_names();
  std::erase_if(running, [&](const SuiteNames& names) {
    return (command.suite != "all" && command.suite != names.suite) || !has_any(command.only, names.parts) ||
           !has_any(command.engines, names.engines);
  });
  return running;
}

}  // namespace

const std::vector<std::string>& bench_suites() {
  static const std::vector<std::string> kSuites{"rigid", "soft", "occupancy", "threads", "scenes", "thesis"};
  return kSuites;
}
const std::vector<BenchOption>& bench_options() {
  static const std::vector<BenchOption> kOptions{
      {"--quick", {"rigid", "soft", "occupancy", "scenes", "thesis"}},
      {"--every-tick", {"rigid"}},
      {"--only", {"rigid", "soft", "occupancy"}},
      {"--meshes", {"rigid"}},
      {"--unit", {"rigid"}},
      {"--sizes", {"soft"}},
      {"--cells", {"occupancy"}},
      {"--scenes", {"threads", "scenes"}},
      {"--seconds", {"soft", "threads"}},
      {"--engines", {"rigid", "soft", "occupancy"}},
      {"--trace", {"rigid"}},
      {"--plot", {"soft", "occupancy"}},
      {"--report", {"thesis"}},
  };
  return kOptions;
}
std::vector<std::string> bench_parts() {
  std::vector<std::string> parts;
  for (const SuiteNames& names : suite_names())
    parts.insert(parts.end(), names.parts.begin(), names.parts.end());
  return parts;
}
std::vector<std::string> bench_engines() {
  std::vector<std::string> engines;
  for (const SuiteNames& names : suite_names()) {
    for (const std::string& name : names.engines) {
      if (std::find(engines.begin(), engines.end(), name) == engines.end()) engines.push_back(name);
    }
  }
  return engines;
}
std::string bench_mesh_error(const std::string& name) {
  try {
    if (!bench::is_bench_mesh_file(name)) (void)bench::bench_mesh_shape(name);
    return {};
  } catch (const std::invalid_argument& e) {
    return e.what();
  }
}

namespace {

// Refuses chosen names that have no effect in any of the suites that run. The message lists the names that
// these suites have.
void refuse_names_without_effect(const BenchCommand& command) {
  std::vector<std::string> parts, engines;
  for (const SuiteNames& names : running_suites(command)) {
    parts.insert(parts.end(), names.parts.begin(), names.parts.end());
    engines.insert(engines.end(), names.engines.begin(), names.engines.end());
  }
  const auto check = [&command](const char* option, const auto& chosen, const auto& known) {
    for (const std::string& name : chosen) {
      if (std::find(known.begin(), known.end(), name) != known.end()) continue;
      throw std::invalid_argument(
          fmt::format("bench {}: {} {} has no effect there; leave it out, or choose from {}", command.suite,
                      option, name, listed(known)));
    }
  };
  if (parts.empty()) return;  // no suite runs; run_suites() refuses the command
  check("--only", command.only, parts);
  check("--engines", command.engines, engines);
}

// Runs the chosen suites and adds their rows to `report` one by one. Throws std::invalid_argument if there is
// nothing to run.
void run_suites(const BenchCommand& command, Outputs& outputs, nlohmann::ordered_json& report) {
  std::FILE* words = outputs.words();
  nlohmann::ordered_json& suites = report["suites"] = nlohmann::ordered_json::object();
  const std::vector<SuiteNames> running = running_suites(command);
  const auto runs = [&running](const char* suite) {
    return std::ranges::find(running, suite, &SuiteNames::suite) != running.end();
  };
  const auto rows_of = [&suites](const char* suite) -> nlohmann::ordered_json& {
    return suites[suite] = nlohmann::ordered_json::array();
  };
  if (runs("rigid")) rigid_suite(command, words, rows_of("rigid"));
  if (runs("soft")) {
    nlohmann::ordered_json growth;
    soft_suite(command, words, outputs, rows_of("soft"), growth);
    report["growth"] = growth;
  }
  if (runs("occupancy")) occupancy_suite(command, words, outputs, rows_of("occupancy"));
  if (command.suite == "threads" && command.scenes.empty())
    throw std::invalid_argument("bench threads: no scene; say which, as in --scenes scenes/cube.toml");
  if (command.suite == "scenes" && command.scenes.empty() && bench::shipped_scenes().empty())
    throw std::invalid_argument("bench scenes: no scene; say which, as in bench scenes/cube.toml");
  if (!command.scenes.empty() && (command.suite == "all" || command.suite == "threads"))
    threads_suite(command, words, rows_of("threads"));
  const bool all = command.suite == "all" && command.only.empty() && command.engines.empty();
  if (command.suite == "scenes" || all) scenes_suite(command, words, rows_of("scenes"));
  if (command.suite == "thesis" || all) thesis_suite(command, words, outputs, report, rows_of("thesis"));
  if (!suites.empty()) return;
  throw std::invalid_argument(fmt::format(
      "bench {}: nothing of --only or --engines belongs to it; paths and engines of rigid are {} and {}, "
      "cases and engines of soft {} and {}, of occupancy {} and {}",
      command.suite, listed(bench::rigid_paths()), listed(names_of(bench::kEngines)),
      listed(bench::soft_cases()), listed(names_of(bench::kSoftEngines)), listed(bench::occupancy_cases()),
      listed(names_of(bench::kOccupancyEngines))));
}

}  // namespace

int run_bench(const BenchCommand& command) {
  refuse_names_without_effect(command);
  Outputs outputs;
  outputs.ask_plot(command.plot);
  outputs.ask_json(command.json);
  ask_report(outputs, command.report);
  nlohmann::ordered_json report = report_head("bench");
  report["quick"] = command.quick;
  const device::StopOnSignal stop;  // after a signal, finished rows are kept
  int signal = 0;
  try {
    run_suites(command, outputs, report);
  } catch (const device::StopAsked& asked) {
    signal = asked.signal;
    report["stopped"] = true;
  }
  end_progress();
  outputs.write_json(command.json, report);
  outputs.say_files();
  if (signal == 0) return outputs.failed() ? 1 : 0;
  std::size_t rows = 0;
  for (const auto& suite : report["suites"]) rows += suite.size();
  return outputs.say_stopped(signal, fmt::format("{} rows", rows));
}

}  // namespace hybrid
