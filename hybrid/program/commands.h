// SPDX-License-Identifier: GPL-3.0-or-later
// The program's commands, without the spelling of their options (main.cpp). Each returns the exit status and
// throws on a refused input.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "hybrid/build/build_world.h"
#include "hybrid/compare/compare_measured.h"
#include "hybrid/compose/compose.h"
#include "hybrid/session/black_box.h"

namespace hybrid {

// A report page: the folder that it is written into, and the command line that makes it again.
struct ReportRequest {
  std::filesystem::path folder;  // empty: no page
  std::string command;
};

struct RunCommand {
  std::filesystem::path scene;
  std::optional<double> seconds;
  bool realtime = false;
  std::string device;       // replaces the scene's device; empty: the scene's
  int samples = 1'000'000;  // more than a session has
  std::uint64_t start_ticks = 0;
  std::string relaxation = "apart";  // or "tick": where tissue away from the contact is relaxed
  std::filesystem::path trace, plot, picture, record, save_surface, save_volume;  // empty: not written
  std::filesystem::path black_box;  // empty: see open_black_box_file()
  ReportRequest report;
  std::string json;  // "-": standard output
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
  bool repair = false;   // also report the changes that `repair = true` would make
  double unit_m = 1e-3;  // of mesh files, as scenes and `compose` have it
  std::string json;
};
int check(const CheckCommand& command);

struct ComposeCommand {
  ComposeOptions options;
  std::string json;
};
int compose(const ComposeCommand& command);

struct DevicesCommand {
  bool calibrate = false;  // take the present pose of the arm as the calibration pose
  std::string json;
};
int devices(const DevicesCommand& command);

struct CompareCommand {
  std::vector<std::filesystem::path> scenes;  // one: an object of it in several ways; more: whole scenes
  int samples = 1'000'000;                    // of whole scenes, as of `run`
  std::string object;                         // empty: the first suitable object
  MeasuredOptions measured;                   // empty file: no measurement
  std::filesystem::path plot;
  bool classic = false;  // the plot also has the thesis's algorithm
  ReportRequest report;
  std::string json;
};
int compare(const CompareCommand& command);
int compare_whole_scenes(const CompareCommand& command);  // two or more

struct TuneCommand {
  std::filesystem::path scene;
  std::optional<double> budget_us;  // of a tick's p99.9; default: half of the device's period
  double error_jnd = 1.0;
  bool quick = false;
  bool apply = false;                 // write the choice into the scene's file
  std::filesystem::path out;          // or into this one, in the same folder; empty: neither
  std::filesystem::path plot, cache;  // empty: not written
  std::string json;
  std::string command_line;  // as it was typed, for the report
};
int tune_scene(const TuneCommand& command);

struct BenchCommand {
  std::string suite;  // of bench_suites(), or "all"
  bool quick = false, every_tick = false;
  std::vector<std::string> only, meshes, engines;  // empty: the suite's own choice
  double mesh_unit_m = 1e-3;                       // of rigid: of mesh files
  std::vector<int> sizes;                          // of soft: voxels an edge; empty: its own choice
  std::vector<std::size_t> cells;                  // of occupancy: occupied cells; empty: its own choice
  std::vector<std::filesystem::path> scenes;       // of threads
  std::optional<double> session_s;  // of soft: simulated time of a session; of threads: real time of a load
  std::filesystem::path trace;      // folder; empty: none
  std::filesystem::path plot;       // of soft: relaxation round by round; of occupancy: times; empty: none
  std::string json;
};
int run_bench(const BenchCommand& command);
// The names that may be chosen, so that a wrong name is refused with the valid ones.
const std::vector<std::string>& bench_suites();
std::vector<std::string> bench_parts();  // paths of rigid, cases of soft and occupancy
std::vector<std::string> bench_engines();
std::string bench_mesh_error(const std::string& name);  // empty: a mesh's name, or a path
// The suites in which each option has an effect. In "all" each has one; options of all suites are left out.
struct BenchOption {
  const char* name;
  std::vector<std::string> suites;
};
const std::vector<BenchOption>& bench_options();

// `hybrid bench compare`: changes between reports of `hybrid bench`. Neither side may be empty.
struct BenchCompareCommand {
  std::vector<std::filesystem::path> olds, news;
  bool all = false;  // list every figure
  std::string json;
};
int bench_compare(const BenchCompareCommand& command);

struct StabilityCommand {
  std::filesystem::path scene, plot;
  bool quick = false;
  ReportRequest report;
  std::string json;
};
int stability(const StabilityCommand& command);
// `hybrid stability SCENE --extremes` and `--fuzz-ticks N`: the suites of extremes.h and fuzz_ticks.h. The
// exit status is 1 if an invariant was violated; the report gives the details.
struct ExtremesCommand {
  std::filesystem::path scene;
  bool table = true;
  bool quick = false;
  std::uint64_t fuzz_ticks = 0, seed = 1;  // 0: none
  bool async_relaxation = false;           // of fuzz_ticks
  std::string json;
};
int extremes(const ExtremesCommand& command);

struct ValidateCommand {
  bool quick = false;
  ReportRequest report;
  std::string json;
};
int validate(
    const ValidateCommand& command);  // the exit status is 1 if a case that is stated to hold does not

struct ViewCommand {
  std::filesystem::path scene;
  std::optional<std::uint64_t>
      frames;  // the window closes after this many; each is written to `out` if that is given
  std::filesystem::path out;
  std::filesystem::path drag;    // CSV of goals that replace the mouse: t, x, y, z
  std::filesystem::path script;  // what a user would do, and when; empty: none
  std::filesystem::path record;  // the session, when the window closes; empty: not written
  std::string device;            // replaces the scene's device; empty: the scene's
};
int view(const ViewCommand& command);

// Progress on standard error. A terminal shows one line that is overwritten. Otherwise, after the first
// second, a line is written at most every two seconds. Throws device::StopAsked once a signal came.
Progress progress_on_terminal();
void end_progress();
// Both write to standard error: the notes of the build, and the file with the seconds around a fault.
void print_notes(const BuiltScene& built);
void print_fault(const BlackBoxFile& kept);

}  // namespace hybrid
