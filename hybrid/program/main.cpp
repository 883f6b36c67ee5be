// SPDX-License-Identifier: GPL-3.0-or-later
// The `hybrid` program: its commands and their options. Exit status: 0 done; 1 refused input, unequal replay
// or violated invariant; 2 wrong usage; 128 plus the number of a signal that ended it.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <iterator>
#include <nlohmann/json.hpp>

#include "device/loop/stop_signal.h"
#include "hybrid/base/file_ending.h"
#include "hybrid/program/command_options.h"
#include "hybrid/program/commands.h"
#include "hybrid/program/help/did_you_mean.h"
#include "hybrid/program/help/program_pages.h"
#include "hybrid/program/report_page.h"
#include "hybrid/scene/table_reader.h"
#include "hybrid/session/outputs.h"
#include "hybrid/session/real_device.h"

namespace {

constexpr const char* kAbout =
    "Touch scenes of rigid and soft objects through a (simulated) force-feedback device.\n\n"
    "  hybrid run scenes/head.toml --plot head.svg --picture head.png   feel a scene, see what was felt\n"
    "  hybrid compare scenes/cube.toml --plot cube.svg                  proxy against voxels, same motion\n"
    "  hybrid view scenes/head.toml                                     a window; drag the tool\n"
    "  hybrid check skull.stl ct.nii.gz my-scene.toml                   the contents and faults of files\n"
    "  hybrid compose --labels labels.nii.gz --names labels.csv --out body   a scene from a scan\n\n"
    "A scene is one small text file; scenes/README.md has its keys. Packages: /usr/share/hybrid/scenes.\n"
    "Exit status: 0 done, 1 input refused (with the place and the remedy), 2 wrong usage, 130 Ctrl-C.";

void add_device(CLI::App& sub, std::string& device) {
  sub.add_option("--device", device, "use this one in place of the scene's")
      ->check(CLI::IsMember(
          std::vector<std::string>(std::begin(hybrid::kDeviceNames), std::end(hybrid::kDeviceNames))));
}

void add_run(CLI::App& app, int& status) {
  auto* sub =
      app.add_subcommand("run", "A haptic session without a display: the scene's path, felt from end to end");
  auto c = std::make_shared<hybrid::RunCommand>();
  sub->add_option("SCENE", c->scene, "scene file (.toml)")->required();
  sub->add_option("--seconds", c->seconds, "length of the session; default: the path and half a second")
      ->check(CLI::PositiveNumber);
  sub->add_flag("--realtime", c->realtime, "pace the loop with a real timer at the device's rate");
  add_device(*sub, c->device);
  auto* samples = sub->add_option(
      "--samples", c->samples,
      "ticks whose force of tissue is compared with the same path played slowly: all in contact, or 0");
  samples->check(CLI::IsMember({"0", "all"}))->capture_default_str();
  auto* reference = sub->add_option("--reference", c->reference, "5 (quick) or 10 (full) times slower");
  reference->check(CLI::IsMember({"quick", "full"}))->capture_default_str();
  sub->add_option("--start-ticks", c->start_ticks,
                  "begin with all clocks and counters as after so many ticks; nothing felt should differ");
  sub->add_option(
         "--relaxation", c->relaxation,
         "where tissue away from the contact comes to rest: apart from the tick, in real time on a thread of "
         "its own, or in the tick, by its budget")
      ->check(CLI::IsMember({"apart", "tick"}))
      ->capture_default_str();
  sub->add_option("--trace", c->trace, "write every tick as CSV");
  sub->add_option("--plot", c->plot, "write force over time with contacts as SVG");
  sub->add_option("--picture", c->picture, "write a picture of the moment with the most contact as PNG");
  auto* video = sub->add_option("--video", c->video,
                                "write the session as a video (.mp4, .mkv, .webm; needs the program ffmpeg)");
  auto* colour = sub->add_option("--colour", c->colour, "what colours tissue in picture and video");
  colour->check(CLI::IsMember(hybrid::tissue_colours()))->capture_default_str();
  sub->add_option("--record", c->record, "write a recording for `hybrid replay`");
  sub->add_option("--black-box", c->black_box,
                  "where the 2 s around the first fault go; default in real time: SCENE-fault.csv here");
  sub->add_option("--save-surface", c->save_surface,
                  "write all surfaces as they are at the end: STL, OBJ (mm), PLY, GLB (m)");
  sub->add_option("--save-volume", c->save_volume,
                  "write each soft object's displacement and moved labels (.nii.gz, .nrrd, .mha)");
  hybrid::add_report(*sub, c->report);
  sub->add_option("--json", c->json, "write the report as JSON; '-' is standard output");
  sub->callback([c, samples, reference, video, colour, &status] {
    if (video->count() > 0 && c->realtime)
      throw CLI::ValidationError("--video", "cannot be drawn in real time; leave out --realtime");
    if (colour->count() > 0 && c->picture.empty() && c->video.empty())
      throw CLI::ValidationError("--colour", "has no effect without --picture or --video");
    if (samples->count() > 0 && c->samples != "0" && c->realtime)
      throw CLI::ValidationError("--samples", "has no effect with --realtime; leave one of them out");
    if (reference->count() > 0 && (c->realtime || c->samples == "0"))
      throw CLI::ValidationError("--reference", "has no effect with --realtime or --samples 0");
    status = hybrid::run(*c);
  });
}

void add_replay(CLI::App& app, int& status) {
  auto* sub = app.add_subcommand(
      "replay", "The same session again from a recording; says at which tick it parts, if it does");
  auto c = std::make_shared<hybrid::ReplayCommand>();
  sub->add_option("RECORDING", c->recording, "file written by `hybrid run --record`")->required();
  sub->add_option("--json", c->json, "write the report as JSON; '-' is standard output");
  sub->callback([c, &status] { status = hybrid::replay(*c); });
}

void add_check(CLI::App& app, int& status) {
  auto* sub = app.add_subcommand(
      "check", "What a scene, mesh or volume is, what is wrong with it, and what it would cost");
  auto c = std::make_shared<hybrid::CheckCommand>();
  sub->add_option("FILE", c->files, "scene (.toml), mesh, volume, or folder of a DICOM series")->required();
  sub->add_flag("--deep", c->deep, "also look for self-intersections (slow on large meshes)");
  sub->add_flag(
      "--repair", c->repair,
      "also say what `repair = true` would do to a mesh, and what is left; the file stays as it is");
  sub->add_option("--unit", c->unit_m,
                  "length unit of mesh files: mm, cm, m, um or a number of meters; default: mm")
      ->transform(CLI::Transformer(hybrid::length_units()))
      ->check(CLI::PositiveNumber);
  sub->add_option("--json", c->json, "write the report as JSON; '-' is standard output");
  sub->callback([c, &status] { status = hybrid::check(*c); });
}

void add_compose(CLI::App& app, int& status) {
  auto* sub = app.add_subcommand(
      "compose", "Writes a scene that runs: from a segmented volume, from meshes and volumes, or a starter");
  auto c = std::make_shared<hybrid::ComposeCommand>();
  hybrid::ComposeOptions& o = c->options;
  sub->add_option(
      "INPUT", o.inputs,
      "meshes (mm), volumes, folders of a DICOM series; with --labels the scan they are of. None: a "
      "starter scene");
  sub->add_option("--out", o.out, "folder to write; scene.toml and the files that it reads")->required();
  auto* labels = sub->add_option("--labels", o.labels, "label volume of a segmentation");
  hybrid::add_tissue_options(*sub, o, labels);
  sub->add_option("--place", o.place, "where an input lies: NAME=x,y,z[,rx,ry,rz] (mm, degrees); repeatable")
      ->take_all();
  sub->add_flag("--force", o.force, "write over a scene that is there");
  sub->add_option("--json", c->json, "write the report as JSON; '-' is standard output");
  sub->callback([c, &status] { status = hybrid::compose(*c); });
}

void add_devices(CLI::App& app, int& status) {
  auto* sub = app.add_subcommand("devices", "What device is connected, and if none, why");
  auto c = std::make_shared<hybrid::DevicesCommand>();
  sub->add_flag("--calibrate", c->calibrate,
                "calibrate a device that is reset by hand, while you hold its arm");
  sub->add_option("--json", c->json, "write the report as JSON; '-' is standard output");
  sub->callback([c, &status] { status = hybrid::devices(*c); });
}

void add_tune(CLI::App& app, int& status) {
  auto* sub = app.add_subcommand(
      "tune", "Chooses spacing, energy and model: the cheapest whose force no hand can tell from the truth");
  auto c = std::make_shared<hybrid::TuneCommand>();
  c->command_line = hybrid::typed_command();
  sub->add_option("SCENE", c->scene, "scene file (.toml)")->required();
  sub->add_option("--budget-us", c->budget_us,
                  "most microseconds of a tick's p99.9; default: half of the device's period")
      ->check(CLI::PositiveNumber);
  sub->add_option("--error-jnd", c->error_jnd, "error that may be felt: p99, in JND")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  sub->add_flag("--quick", c->quick, "fewer settings and passes; a few minutes");
  auto* apply =
      sub->add_flag("--apply", c->apply, "write the choice into the scene's file; the rest of it stays");
  sub->add_option("--out", c->out, "write the choice into a new scene file, in the folder of the scene")
      ->excludes(apply);
  sub->add_option("--cache", c->cache, "folder that keeps finished parts; a repeated command goes on there");
  sub->add_option("--plot", c->plot, "write error over cost of all settings as SVG");
  hybrid::add_report(*sub, c->report);
  sub->add_option("--json", c->json, "write the report as JSON; '-' is standard output");
  sub->callback([c, &status] { status = hybrid::tune_scene(*c); });
}

CLI::Validator one_of(const std::vector<std::string>& known) {
  return {[known](const std::string& name) { return hybrid::unknown_name(name, known); },
          CLI::detail::generate_set(known)};
}

// Refuses options that have no effect in the suite, and names the suites in which they have one.
void refuse_unused(const CLI::App& bench, const std::string& suite) {
  for (const hybrid::BenchOption& option : hybrid::bench_options()) {
    const auto& suites = option.suites;
    if (suite == "all" || bench.count(option.name) == 0 ||
        std::find(suites.begin(), suites.end(), suite) != suites.end())
      continue;
    std::string takers;
    for (const std::string& taker : suites) takers.append("bench ").append(taker).append(", ");
    throw CLI::ValidationError(
        fmt::format("{} has no effect in bench {}; leave it out, or use it with {}or bench all", option.name,
                    suite, takers));
  }
}

CLI::Validator suite_or_scene(const std::vector<std::string>& suites) {
  return {[suites](const std::string& name) {
            return std::filesystem::is_regular_file(name) ? std::string()
                                                          : hybrid::unknown_name(name, suites);
          },
          CLI::detail::generate_set(suites)};
}

// Sets suite and scenes from the arguments: one suite, or scene files, which are the suite "scenes".
void take_suite(hybrid::BenchCommand& command, const std::vector<std::string>& suites) {
  const auto is_suite = [&suites](const std::string& name) {
    return std::find(suites.begin(), suites.end(), name) != suites.end();
  };
  if (command.what.size() == 1 && is_suite(command.what[0])) {
    command.suite = command.what[0];
    return;
  }
  for (const std::string& name : command.what) {
    if (is_suite(name))
      throw CLI::ValidationError("bench: " + name + " beside others; give one suite, or scene files alone");
    command.scenes.emplace_back(name);
  }
  command.suite = "scenes";
}

CLI::App* add_bench_compare(CLI::App& bench, int& status) {
  auto* sub =
      bench.add_subcommand("compare",
                           "Changes between reports of this command, told from noise:\n"
                           "  hybrid bench compare old1.json old2.json ... --to new1.json new2.json ...");
  auto c = std::make_shared<hybrid::BenchCompareCommand>();
  sub->add_option("OLD", c->olds, "reports of the old build; OLD and NEW if there is no --to")->required();
  sub->add_option("--to", c->news, "reports of the new build, measured in turns with the old ones");
  sub->add_flag("--all", c->all, "list every figure, not only the first");
  sub->add_option("--json", c->json, "write the report as JSON; '-' is standard output");
  sub->callback([c, &bench, &status] {
    for (const CLI::Option* option : bench.get_options()) {
      if (option->count() > 0)
        throw CLI::ValidationError(
            option->get_name() +
            " before compare has no effect; leave it out (options of compare follow it)");
    }
    if (c->news.empty()) {
      if (c->olds.size() != 2)
        throw CLI::ValidationError(
            "bench compare: " + std::to_string(c->olds.size()) +
            (c->olds.size() == 1 ? " report" : " reports") +
            " and no --to; give OLD.json NEW.json, or repeats of both as OLD.json ... --to NEW.json ...");
      c->news = {c->olds.back()};
      c->olds.pop_back();
    }
    status = hybrid::bench_compare(*c);
  });
  return sub;
}

void add_bench(CLI::App& app, int& status) {
  auto* sub = app.add_subcommand("bench", "Times and errors beside baselines, over meshes of all sizes");
  auto c = std::make_shared<hybrid::BenchCommand>();
  std::vector<std::string> suites = hybrid::bench_suites();
  suites.emplace_back("all");
  sub->add_option("SUITE", c->what,
                  "what to time: a suite, or scene files, each beside other models of its objects")
      ->check(suite_or_scene(suites));
  sub->add_flag("--quick", c->quick, "a short piece of each path on small meshes; a few seconds");
  sub->add_flag("--every-tick", c->every_tick, "ask the exact reference at every tick; slow");
  sub->add_option("--only", c->only, "paths of rigid, cases of soft and occupancy, with commas between")
      ->delimiter(',')
      ->check(one_of(hybrid::bench_parts()));
  auto* meshes =
      sub->add_option(
             "--meshes", c->meshes,
             "of rigid: meshes, with commas between: files (my.obj), and ico0 to ico9 (20 x 4^n triangles), "
             "geo1 to geo1024 (20 x n^2), cube1 to cube1024, corner1 to corner1024")
          ->delimiter(',')
          ->check(CLI::Validator(hybrid::bench_mesh_error, "MESH"));
  sub->add_option("--unit", c->mesh_unit_m, "of rigid: length unit of mesh files in meters")
      ->check(CLI::PositiveNumber)
      ->needs(meshes)
      ->capture_default_str();
  sub->add_option("--sizes", c->sizes, "of soft: voxels an edge of sessions and loads, with commas between")
      ->delimiter(',')
      ->check(CLI::Range(16, 1024));
  sub->add_option("--cells", c->cells, "of occupancy: occupied cells, about, with commas between")
      ->delimiter(',')
      ->check(CLI::Range(100, 20'000'000));
  sub->add_option("--scenes", c->scenes, "of threads and scenes: scene files, with commas between")
      ->delimiter(',')
      ->check(CLI::ExistingFile);
  sub->add_option("--seconds", c->session_s,
                  "of soft: simulated time of a session; of threads: real time of each load (60)")
      ->check(CLI::Range(0.1, 3600.0));
  sub->add_option("--engines", c->engines, "engines, with commas between")
      ->delimiter(',')
      ->check(one_of(hybrid::bench_engines()));
  sub->add_option("--trace", c->trace, "of rigid: write every run as CSV into this folder");
  sub->add_option("--plot", c->plot,
                  "as SVG: of soft relaxation round by round, classic's and ours; of occupancy look-ups over "
                  "cells (with all: beside it, NAME-occupancy.svg)");
  hybrid::add_report(*sub, c->report);
  sub->add_option("--json", c->json, "write the report as JSON; '-' is standard output");
  const CLI::App* compare = add_bench_compare(*sub, status);
  sub->callback([c, sub, compare, suites, &status] {
    if (compare->parsed()) return;
    if (c->what.empty()) throw CLI::RequiredError("SUITE");
    take_suite(*c, suites);
    refuse_unused(*sub, c->suite);
    status = hybrid::run_bench(*c);
  });
}

void add_stability(CLI::App& app, int& status) {
  auto* sub = app.add_subcommand(
      "stability", "Up to which stiffness the loop is stable, passive and calm: measured, beside theory");
  auto c = std::make_shared<hybrid::StabilityCommand>();
  auto e = std::make_shared<hybrid::ExtremesCommand>();
  e->table = false;
  sub->add_option("SCENE", c->scene, "scene file (.toml), such as scenes/wall.toml")->required();
  auto* plot = sub->add_option("--plot", c->plot, "stiffness over damping and rate as SVG (rigid scenes)");
  hybrid::add_report(*sub, c->report);
  sub->add_option("--json", c->json, "write the report as JSON; '-' is standard output");
  sub->add_flag("--extremes", e->table,
                "instead: rigid, soft and mixed scenes with every setting taken to its end")
      ->excludes(plot);
  sub->add_flag("--quick", c->quick, "a row of each kind, or a share of --extremes; some seconds");
  auto* ticks =
      sub->add_option("--fuzz-ticks", e->fuzz_ticks, "instead: so many ticks of random device input")
          ->excludes(plot);
  sub->add_option("--seed", e->seed, "of --fuzz-ticks")->needs(ticks)->capture_default_str();
  sub->add_flag("--apart", e->async_relaxation, "with --fuzz-ticks: tissue is relaxed apart from the tick")
      ->needs(ticks);
  sub->callback([c, e, &status] {
    e->scene = c->scene;
    e->json = c->json;
    e->quick = c->quick;
    const bool other = e->table || e->fuzz_ticks > 0;
    if (other && !c->report.folder.empty())
      throw CLI::ValidationError("--report", "has no page for --extremes and --fuzz-ticks; use --json");
    status = other ? hybrid::extremes(*e) : hybrid::stability(*c);
  });
}

void add_validate(CLI::App& app, int& status) {
  auto* sub = app.add_subcommand(
      "validate", "The program's forces against closed forms, finite elements and measured tissue");
  auto c = std::make_shared<hybrid::ValidateCommand>();
  sub->add_flag("--quick", c->quick, "coarser grids, without the cases that take minutes");
  hybrid::add_report(*sub, c->report);
  sub->add_option("--json", c->json, "write the report as JSON; '-' is standard output");
  sub->callback([c, &status] { status = hybrid::validate(*c); });
}

void add_view(CLI::App& app, int& status) {
  auto* sub = app.add_subcommand("view", "A window; the mouse drags the tool (right button)");
  auto c = std::make_shared<hybrid::ViewCommand>();
  sub->add_option("SCENE", c->scene, "scene file (.toml); without it, the window offers scenes");
  sub->add_option("--frames", c->frames, "close after this many frames")->check(CLI::PositiveNumber);
  sub->add_option("--out", c->out, "write each frame as PNG into this folder");
  sub->add_option("--video", c->video, "write the frames as a video (.mp4, .mkv, .webm; needs ffmpeg)");
  sub->add_option("--width", c->width, "width of the window (pixels)")->check(CLI::Range(64, 8192));
  sub->add_option("--height", c->height, "height of the window (pixels)")->check(CLI::Range(64, 8192));
  add_device(*sub, c->device);
  sub->add_option("--drag", c->drag, "drag the tool along a CSV (t_s, x_m, y_m, z_m) instead of the mouse");
  sub->add_option("--script", c->script, "play keys, clicks and edits from this text file");
  sub->add_option("--record", c->record, "write the session for `hybrid replay` when the window closes");
  sub->callback([c, &status] { status = hybrid::view(*c); });
}

// The exit status after flushing standard output. If that fails, it is an error, unless the reader closed the
// pipe.
int flushed(int status) {
  errno = 0;
  if (std::fflush(stdout) == 0 || errno == EPIPE) return status;
  std::fprintf(stderr, "standard output cannot be written (%s); see that the disk has room\n",
               std::strerror(errno));
  return status == 0 ? 1 : status;
}

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGXFSZ, SIG_IGN);  // then a write beyond the limit of the file size fails with an error
  hybrid::end_at_once_on_signals();
  CLI::App app(kAbout, "hybrid");
  app.require_subcommand(1);
  hybrid::add_pages(app, HYBRID_VERSION);
  int status = 0;
  hybrid::typed_command() = hybrid::command_line(argc, argv);
  add_run(app, status);
  add_replay(app, status);
  add_check(app, status);
  add_compose(app, status);
  add_devices(app, status);
  hybrid::add_compare(app, status);
  add_tune(app, status);
  hybrid::add_study(app, status);
  add_bench(app, status);
  add_stability(app, status);
  add_validate(app, status);
  add_view(app, status);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (app.exit(e) == 0) return flushed(0);  // the user asked for --help, --version or a page
    std::fputs(hybrid::did_you_mean(app, {argv + 1, argv + argc}).c_str(), stderr);
    return 2;
  } catch (const device::StopAsked& asked) {
    hybrid::end_progress();
    return hybrid::Outputs().say_stopped(asked.signal, "");
  } catch (const std::bad_alloc&) {
    hybrid::end_progress();
    std::fputs("hybrid: out of memory; use a coarser spacing or a smaller part of the data\n", stderr);
    return 1;
  } catch (const std::exception& e) {
    hybrid::end_progress();
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
  }
  return flushed(status);
}
