// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "hybrid/plot/session_plot.h"
#include "hybrid/program/commands.h"
#include "hybrid/session/export_shapes.h"
#include "hybrid/session/real_device.h"
#include "hybrid/session/recording.h"
#include "hybrid/session/report.h"
#include "hybrid/session/session.h"
#include "hybrid/session/trace_file.h"
#include "hybrid/snapshot/make_drawn_scene.h"
#include "hybrid/view/picture.h"

namespace hybrid {
namespace {

bool& progress_shown() {
  static bool shown = false;
  return shown;
}

// Text goes to standard output, unless the report goes there.
std::FILE* words_for(const std::string& json) {
  return json == "-" ? stderr : stdout;
}

std::string read_text(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

// Finds an output that cannot be written before a long run, not after it.
void check_writable(const std::filesystem::path& file) {
  if (file.empty()) return;
  if (file.has_parent_path()) {
    std::error_code error;
    std::filesystem::create_directories(file.parent_path(), error);
  }
  const bool existed = std::filesystem::exists(file);
  const bool writable = static_cast<bool>(std::ofstream(file, std::ios::app));
  if (!writable)
    throw std::runtime_error(fmt::format("{}: cannot be written; check the folder", file.string()));
  if (!existed) std::filesystem::remove(file);
}

}  // namespace

Progress progress_on_terminal() {
  const auto start = std::chrono::steady_clock::now();
  const bool terminal = isatty(STDERR_FILENO) != 0;
  return [start, terminal, last = start](const std::string& text) mutable {
    const auto now = std::chrono::steady_clock::now();
    if (terminal) {
      std::fprintf(stderr, "\r\033[K%s", text.c_str());
      std::fflush(stderr);
      progress_shown() = true;
    } else if (now - start > std::chrono::seconds(1) && now - last > std::chrono::seconds(2)) {
      last = now;
      std::fprintf(stderr, "%s\n", text.c_str());
    }
  };
}

void end_progress() {
  if (!progress_shown()) return;
  std::fprintf(stderr, "\r\033[K");
  progress_shown() = false;
}

void print_notes(const BuiltScene& built) {
  for (const BuildNote& note : built.notes) {
    const char* mark = note.severity == polygon::Severity::info ? "note" : "warning";
    std::fprintf(stderr, "%s: %s%s%s\n", mark, note.object.c_str(), note.object.empty() ? "" : ": ",
                 note.text.c_str());
  }
}

void print_fault(const BlackBoxFile& kept) {
  const std::string said = kept.save_on_fault();
  if (!said.empty()) std::fprintf(stderr, "warning: %s\n", said.c_str());
}

int run(const RunCommand& command) {
  Scene scene = load_scene(command.scene);
  if (!command.device.empty()) use_device(scene, command.device);
  for (const auto* file : {&command.trace, &command.plot, &command.picture, &command.record,
                           &command.save_surface, &command.black_box}) {
    check_writable(*file);
  }
  if (!command.save_volume.empty()) {
    for (const auto& file : saved_volume_names(command.save_volume, scene)) check_writable(file);
  }
  if (command.json != "-") check_writable(command.json);
  const Progress progress = progress_on_terminal();
  const auto real = open_real_device(scene);  // before the build, which may take long
  BuiltScene built = build_scene(scene, progress);
  end_progress();
  print_notes(built);
  if (real) {
    std::fprintf(stderr, "note: %s\n", place_real_device(scene, *built.world, *real).c_str());
    await_free_tool(scene, *built.world, *built.state, *real, progress);
    end_progress();
    std::fprintf(stderr, "note: in touch now; Ctrl-C ends the session and keeps it\n");
  }
  const bool realtime = command.realtime || real;
  const auto kept = open_black_box_file(command.black_box, command.scene, realtime, scene.rate_hz);
  SessionOptions options{.seconds = command.seconds,
                         .realtime = command.realtime,
                         .real_device = real.get(),
                         .keep_rows = !command.trace.empty() || !command.plot.empty(),
                         .keep_recording = !command.record.empty(),
                         .keep_clearance = !command.plot.empty(),
                         .keep_picture = !command.picture.empty(),
                         .reference_samples = command.samples,
                         .start_ticks = command.start_ticks,
                         .progress = progress,
                         .async_relaxation = command.relaxation == "apart",
                         .black_box = kept ? &kept->box() : nullptr};
  SessionResult result = run_session(scene, built, options);
  end_progress();
  if (kept) print_fault(*kept);

  std::FILE* words = words_for(command.json);
  if (!command.trace.empty()) save_trace(command.trace, result.rows);
  const std::string title = scene.title.empty() ? command.scene.stem().string() : scene.title;
  if (!command.plot.empty()) {
    std::vector<PlottedObject> objects;
    for (std::size_t o = 0; o < built.world->object_count(); ++o) {
      const std::size_t rigid = built.world->rigid.size();
      objects.push_back({o < rigid ? built.world->rigid[o].name : built.world->soft[o - rigid].name,
                         o >= rigid, result.object_force_N[o]});
    }
    save_session_plot(command.plot, result.rows, objects, title, result.clearance);
  }
  if (!command.picture.empty())
    save_picture(command.picture, drawn_scene(scene, built, title), *result.moment);
  if (!command.record.empty()) {
    save_recording(command.record, {std::filesystem::absolute(command.scene), read_text(command.scene),
                                    result.dt_s, scene_limits(scene), options.async_relaxation,
                                    result.state_hash, result.start_m, result.recording});
  }
  if (!command.save_surface.empty()) save_surfaces(command.save_surface, built);
  std::vector<std::filesystem::path> volumes;
  if (!command.save_volume.empty()) volumes = save_volumes(command.save_volume, scene, built);
  if (!command.json.empty()) save_json(command.json, run_report(scene, built, result));
  fmt::print(words, "{}", run_summary(built, result));
  for (const auto& [what, file] :
       {std::pair{"trace", command.trace}, std::pair{"plot", command.plot},
        std::pair{"picture", command.picture}, std::pair{"recording", command.record},
        std::pair{"surface", command.save_surface}}) {
    if (!file.empty()) fmt::print(words, "{}: {}\n", what, file.string());
  }
  for (const auto& file : volumes) fmt::print(words, "volume: {}\n", file.string());
  return result.end == device::ServoEnd::lost ? 1 : 0;
}

int replay(const ReplayCommand& command) {
  const Recording recording = load_recording(command.recording);
  const ReplayResult result = replay(recording, progress_on_terminal());
  end_progress();
  if (!command.json.empty()) {
    nlohmann::ordered_json j = report_head("replay");
    j["ticks"] = result.ticks;
    j["state_hash"] = fmt::format("{:016x}", result.state_hash);
    j["equal"] = result.equal;
    if (!result.equal) j["parts_at_tick"] = result.first_difference;
    save_json(command.json, j);
  }
  fmt::print(words_for(command.json), "{}\n",
             result.equal
                 ? fmt::format("equal: {} ticks, state hash {:016x}", result.ticks, result.state_hash)
                 : fmt::format("parts at tick {} of {}: this build does not feel what was recorded",
                               result.first_difference, result.ticks));
  return result.equal ? 0 : 1;
}

}  // namespace hybrid
