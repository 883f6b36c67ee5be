// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "hybrid/bench_rigid.h"
#include "hybrid/commands.h"
#include "hybrid/report.h"

namespace hybrid {
namespace {

std::vector<bench::Engine> engines_of(const std::vector<std::string>& names) {
  std::vector<bench::Engine> engines;
  for (const bench::Engine engine : bench::kEngines) {
    if (std::find(names.begin(), names.end(), bench::engine_name(engine)) != names.end())
      engines.push_back(engine);
  }
  return engines;
}

// The product's own figures at a glance.
std::string summary(const std::vector<bench::RigidRow>& rows) {
  std::size_t runs = 0, inside = 0, pops = 0, lost = 0;
  double worst = 0.0;
  for (const bench::RigidRow& row : rows) {
    if (row.engine != bench::Engine::hybrid) continue;
    ++runs;
    inside += row.judged.inside_ticks;
    pops += row.judged.pop_throughs;
    lost += row.judged.lost_ticks;
    if (row.judged.error_mesh_max) worst = std::max(worst, *row.judged.error_mesh_max / row.scale);
  }
  if (runs == 0) return {};
  return fmt::format(
      "hybrid, {} runs: {} ticks inside, {} times popped through; error against the mesh at most {:.3g} um "
      "(of a scene of size 1), {} ticks without an optimum nearby\n",
      runs, inside, pops, 1e6 * worst, lost);
}

nlohmann::ordered_json rigid_suite(const BenchCommand& command, std::FILE* words) {
  bench::RigidBenchOptions options{.quick = command.quick,
                                   .every_tick = command.every_tick,
                                   .paths = command.paths,
                                   .meshes = command.meshes,
                                   .engines = engines_of(command.engines),
                                   .trace = command.trace,
                                   .progress = progress_on_terminal(),
                                   .on_row = {}};
  options.on_row = [words](const bench::RigidRow& row) {
    end_progress();
    fmt::print(words, "{}", bench::table_line(row));
    std::fflush(words);
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
    fmt::print(words, "\nhybrid's own times, and how many times as long the baselines took:\n{}", ratios);
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (const bench::RigidRow& row : rows) json.push_back(bench::to_json(row));
  return json;
}

}  // namespace

const std::vector<std::string>& bench_suites() {
  static const std::vector<std::string> kSuites{"rigid"};
  return kSuites;
}
const std::vector<std::string>& bench_paths() {
  return bench::rigid_paths();
}
std::vector<std::string> bench_engines() {
  std::vector<std::string> names;
  names.reserve(std::size(bench::kEngines));
  for (const bench::Engine engine : bench::kEngines) names.emplace_back(bench::engine_name(engine));
  return names;
}
std::string bench_mesh_error(const std::string& name) {
  try {
    bench::bench_mesh_shape(name);
    return {};
  } catch (const std::invalid_argument& e) {
    return e.what();
  }
}

int run_bench(const BenchCommand& command) {
  std::FILE* words = command.json == "-" ? stderr : stdout;
  nlohmann::ordered_json report = report_head("bench");
  report["quick"] = command.quick;
  report["suites"] = nlohmann::ordered_json::object();
  for (const std::string& suite : bench_suites()) {
    if (command.suite != "all" && command.suite != suite) continue;
    if (suite == "rigid") report["suites"]["rigid"] = rigid_suite(command, words);
  }
  if (!command.json.empty()) save_json(command.json, report);
  return 0;
}

}  // namespace hybrid
