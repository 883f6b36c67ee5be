// SPDX-License-Identifier: GPL-3.0-or-later
// The program's commands. main.cpp spells their options. Each command returns the exit status, and throws if
// an input is refused.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "hybrid/build/build_world.h"
#include "hybrid/compare/compare_measured.h"
#include "hybrid/compose/compose.h"
#include "hybrid/program/view/view_command.h"
#include "hybrid/session/black_box.h"
#include "hybrid/study/judge_scan.h"

namespace hybrid {

// A report page: the folder into which it is written, and the command line that makes it again.
struct ReportRequest {
  std::filesystem::path folder;  // empty: no page
  std::string command;
};

struct RunCommand {
  std::filesystem::path scene;
  std::optional<double> seconds;
  bool realtime = false;
  std::string device;               // replaces the scene's device; empty: the scene's
  std::string samples = "all";      // ticks in contact whose force is compared with a slow run, or "0"
  std::string reference = "quick";  // "quick" or "full" (Reference)
  std::uint64_t start_ticks = 0;
  // Where tissue away from the contact is relaxed: "apart" (on a thread of its own) or "tick".
  std::string relaxation = "apart";
  std::filesystem::path trace, plot, picture, video, record, save_surface, save_volume;  // empty: not written
  std::string colour = "displacement";  // of tissue in picture and video (TissueColour)
  std::filesystem::path black_box;      // empty: see open_black_box_file()
  ReportRequest report;
  std::string json;  // "-": standard output
};
int run(const RunCommand& command);
// Names for RunCommand::colour.
[[nodiscard]] std::vector<std::string> tissue_colours();

struct ReplayCommand {
  std::filesystem::path recording;
  std::string json;
};
int replay(const ReplayCommand& command);

struct CheckCommand {
  std::vector<std::filesystem::path> files;
  bool deep = false;
  bool repair = false;   // also report the changes that `repair = true` would make
  double unit_m = 1e-3;  // length unit of mesh files; the default is that of scenes and `compose`
  std::string json;
};
int check(const CheckCommand& command);

struct ComposeCommand {
  ComposeOptions options;
  std::string json;
};
int compose(const ComposeCommand& command);

struct DevicesCommand {
  bool calibrate = false;  // take the arm's present pose as the calibration pose
  std::string json;
};
int devices(const DevicesCommand& command);

struct CompareCommand {
  std::vector<std::filesystem::path>
      scenes;                   // one scene: one of its objects by several models; several: whole scenes
  std::string samples = "all";  // only for whole scenes; as in RunCommand
  std::string object;           // empty: the first suitable object
  MeasuredOptions measured;     // empty file: no measurement
  std::filesystem::path plot;
  bool classic = false;         // the plot also has the thesis's algorithm
  bool models = false;          // plays one whole scene with other models of its objects
  bool write_variants = false;  // with `models`: writes the variants as scenes beside the given one
  std::filesystem::path cache;  // with `models`: folder of the kept reference; empty: nothing is kept
  ReportRequest report;
  std::string json;
};
int compare(const CompareCommand& command);
int compare_whole_scenes(const CompareCommand& command);     // with two or more scenes
int compare_models_in_scene(const CompareCommand& command);  // with `models`

struct TuneCommand {
  std::filesystem::path scene;
  std::optional<double> budget_us;  // limit for the p99.9 of the tick; default: half of the device's period
  double error_jnd = 1.0;
  bool quick = false;
  bool apply = false;                 // write the choice into the scene's file
  std::filesystem::path out;          // write the choice into this file in the scene's folder; empty: do not
  std::filesystem::path plot, cache;  // empty: not written
  ReportRequest report;
  std::string json;
  std::string command_line;  // as it was typed; for the report
};
int tune_scene(const TuneCommand& command);

struct StudyCommand {
  std::vector<std::filesystem::path> scans;
  std::vector<std::string> labels;  // as in pair_scans()
  StudyOptions options;             // without `scans`
  std::string json;
  std::string command_line;  // as it was typed
};
int study(const StudyCommand& command);  // the exit status is 1 if every scan failed

struct BenchCommand {
  std::vector<std::string> what;  // as typed: a suite, or scene files
  std::string suite;              // a name of bench_suites(), or "all"
  bool quick = false, every_tick = false;
  std::vector<std::string> only, meshes, engines;  // empty: the suite chooses
  double mesh_unit_m = 1e-3;                       // rigid: length unit of mesh files
  std::vector<int> sizes;                          // soft: voxels along an edge; empty: the suite chooses
  std::vector<std::size_t> cells;                  // occupancy: occupied cells; empty: the suite chooses
  std::vector<std::filesystem::path> scenes;       // threads, scenes: the scenes
  std::optional<double> session_s;  // soft: simulated time of a session; threads: real time of a load
  std::filesystem::path trace;      // folder of traces; empty: none
  std::filesystem::path plot;       // soft: relaxation per round; occupancy: times; empty: none
  ReportRequest report;             // thesis
  std::string json;
};
int run_bench(const BenchCommand& command);
// The names that may be chosen. A wrong name is refused with the list of valid ones.
const std::vector<std::string>& bench_suites();
std::vector<std::string> bench_parts();  // paths of rigid, cases of soft and occupancy
std::vector<std::string> bench_engines();
std::string bench_mesh_error(const std::string& name);  // empty if the name is that of a mesh or is a path
// The suites in which each option has an effect. Options that have an effect in all suites are not listed.
struct BenchOption {
  const char* name;
  std::vector<std::string> suites;
};
const std::vector<BenchOption>& bench_options();

// `hybrid bench compare`: changes between reports of `hybrid bench`. There must be reports on both sides.
struct BenchCompareCommand {
  std::vector<std::filesystem::path> olds, news;
  bool all = false;  // list every figure, not only the first
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
// exit status is 1 if an invariant was violated. The report gives the details.
struct ExtremesCommand {
  std::filesystem::path scene;
  bool table = true;
  bool quick = false;
  std::uint64_t fuzz_ticks = 0, seed = 1;  // 0: none
  bool async_relaxation = false;           // only for fuzz_ticks
  std::string json;
};
int extremes(const ExtremesCommand& command);

struct ValidateCommand {
  bool quick = false;
  ReportRequest report;
  std::string json;
};
int validate(const ValidateCommand& command);  // the exit status is 1 if a stated case does not hold

int view(const ViewCommand& command);

// Progress on standard error. A terminal shows one line that is overwritten. Otherwise, after the first
// second, a line is written at most every two seconds. Throws device::StopAsked once a signal came.
Progress progress_on_terminal();
void end_progress();
// Both write to standard error. print_notes(): notes of the build. print_fault(): the file with the seconds
// around a fault.
void print_notes(const BuiltScene& built);
void print_fault(const BlackBoxFile& kept);

}  // namespace hybrid
