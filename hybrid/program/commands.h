// SPDX-License-Identifier: GPL-3.0-or-later
// What the program's commands do, apart from how their options are spelled (main.cpp). Each returns the exit
// status, and throws where an input is refused.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "hybrid/session/black_box.h"
#include "hybrid/build/build_world.h"
#include "hybrid/compare/compare_measured.h"
#include "hybrid/compose/compose.h"

namespace hybrid {

struct RunCommand {
  std::filesystem::path scene;
  std::optional<double> seconds;
  bool realtime = false;
  std::string device;  // in place of the scene's; empty: the scene's
  int samples = 6;
  std::uint64_t start_ticks = 0;
  std::string relaxation = "apart";  // or "tick": where tissue away from the contact is relaxed
  std::filesystem::path trace, plot, picture, record, save_surface, save_volume;  // empty: not written
  std::filesystem::path black_box;                                                // empty: see keep_box()
  std::string json;                                                               // "-": standard output
};
int run(const RunCommand& command);

struct ReplayCommand {
  std::filesystem::path recording;
  std::string json;
};
int replay(const ReplayCommand& command);

struct CheckCommand {
  std::vector<std::filesystem::path> files;
  bool deep = false;
  bool repair = false;  // also say what `repair = true` would do to a mesh
  double unit_m = 1.0;  // of mesh files
  std::string json;
};
int check(const CheckCommand& command);

struct ComposeCommand {
  ComposeOptions options;
  std::string json;
};
int compose(const ComposeCommand& command);

struct DevicesCommand {
  bool calibrate = false;  // take the pose in which the hand holds the arm as the one of calibration
  std::string json;
};
int devices(const DevicesCommand& command);

struct CompareCommand {
  std::filesystem::path scene;
  std::string object;        // empty: the first that can be compared
  MeasuredOptions measured;  // its file empty: no measurement
  std::filesystem::path plot;
  std::string json;
};
int compare(const CompareCommand& command);

struct BenchCommand {
  std::string suite;  // of bench_suites(), or "all"
  bool quick = false, every_tick = false;
  std::vector<std::string> only, meshes, engines;  // empty: the suite's own choice
  std::vector<int> sizes;                          // of soft: voxels an edge; empty: its own choice
  std::vector<std::size_t> cells;                  // of occupancy: occupied cells; empty: its own choice
  std::vector<std::filesystem::path> scenes;       // of threads
  std::optional<double> session_s;  // of soft: simulated time of a session; of threads: real time of a load
  std::filesystem::path trace;      // folder; empty: none
  std::filesystem::path plot;       // of soft: relaxation round by round; of occupancy: times; empty: none
  std::string json;
};
int run_bench(const BenchCommand& command);
// What may be asked for, so that a wrong word is refused with the right ones.
const std::vector<std::string>& bench_suites();
std::vector<std::string> bench_parts();  // paths of rigid, cases of soft and occupancy
std::vector<std::string> bench_engines();
std::string bench_mesh_error(const std::string& name);  // empty: there is such a mesh

struct StabilityCommand {
  std::filesystem::path scene, plot;
  std::string json;
};
int stability(const StabilityCommand& command);
// `hybrid stability SCENE --extremes`, `--fuzz-ticks N`: the suite of extremes.h, and fuzz_ticks.h. The
// status is 0 also when something fell short: the report says so.
struct ExtremesCommand {
  std::filesystem::path scene;
  bool table = true;
  bool quick = false;
  std::uint64_t fuzz_ticks = 0, seed = 1;  // 0: none
  bool async_relaxation = false;                // of fuzz_ticks
  std::string json;
};
int extremes(const ExtremesCommand& command);

struct ViewCommand {
  std::filesystem::path scene;
  std::optional<std::uint64_t> frames;  // then closes; each written to `out` when that is given
  std::filesystem::path out;
  std::filesystem::path drag;  // CSV of goals that stand for the mouse: t, x, y, z
  std::string device;          // in place of the scene's; empty: the scene's
};
int view(const ViewCommand& command);

// Progress on standard error, one line that is overwritten on a terminal, and nothing when standard error is
// no terminal and less than a second has passed.
Progress progress_on_terminal();
void end_progress();
// On standard error: what the build noticed; where the seconds around a fault are, if there was one.
void print_notes(const BuiltScene& built);
void print_fault(const KeptBox& kept);

}  // namespace hybrid
