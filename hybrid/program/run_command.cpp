// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <exception>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <stdexcept>

#include "device/loop/stop_signal.h"
#include "hybrid/base/file_ending.h"
#include "hybrid/plot/session_plot.h"
#include "hybrid/program/commands.h"
#include "hybrid/program/report_page.h"
#include "hybrid/program/run_page.h"
#include "hybrid/program/view/viewed_scene.h"
#include "hybrid/session/export_shapes.h"
#include "hybrid/session/outputs.h"
#include "hybrid/session/real_device.h"
#include "hybrid/session/recording.h"
#include "hybrid/session/report.h"
#include "hybrid/session/session.h"
#include "hybrid/session/trace_file.h"
#include "hybrid/snapshot/fill_snapshot.h"
#include "hybrid/snapshot/make_drawn_scene.h"
#include "hybrid/view/glb_file.h"
#include "hybrid/view/layout.h"
#include "hybrid/view/picture.h"
#include "hybrid/view/tissue_view.h"
#include "hybrid/window/video.h"

namespace hybrid {
namespace {

// Greatest number of moments of a session at which the forces between objects are computed.
constexpr int kBetweenSamples = 200;

bool& progress_shown() {
  static bool shown = false;
  return shown;
}

std::string read_text(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

void ask_outputs(const RunCommand& command, const Scene& scene, Outputs& outputs) {
  outputs.ask("--trace", command.trace, {".csv", ".txt"});
  outputs.ask_plot(command.plot);
  outputs.ask("--picture", command.picture, {".png"});
  outputs.ask("--video", command.video, {".mp4", ".mkv", ".webm"});
  if (!command.video.empty()) require_ffmpeg();
  require_ending_of_none("--record", command.record);
  outputs.ask("--record", command.record, {});
  outputs.ask("--save-surface", command.save_surface, {".ply", ".stl", ".obj", ".glb"});
  outputs.ask("--black-box", command.black_box, {".csv", ".txt"});
  if (!command.save_volume.empty()) {
    for (const auto& file : saved_volume_names(command.save_volume, scene))
      outputs.ask("--save-volume", file, {});
  }
  ask_report(outputs, command.report);
  outputs.ask_json(command.json);
}

ViewSettings view_of(const RunCommand& command) {
  ViewSettings view;
  view.colour = tissue_colour_named(command.colour).value_or(TissueColour::displacement);
  return view;
}

// The session as a video. Drawing begins with the first frame. An error ends the drawing, and keep() throws
// it.
class RunVideo {
 public:
  RunVideo(const std::filesystem::path& file, const DrawnScene& drawn, const ViewSettings& view)
      : file_(file), drawn_(drawn) {
    options_.view = view;
  }
  void add(const Snapshot& snapshot) noexcept {
    if (why_not_) return;
    try {
      if (!maker_) {
        const double aspect = frame_layout(options_.width, options_.height, false).aspect();
        options_.camera = frame_scene(drawn_, snapshot, aspect, drawn_.path_m);
        maker_.emplace(drawn_, options_.height);
        video_.emplace(file_, options_.width, options_.height, static_cast<int>(kFrames_per_s));
      }
      video_->add(options_.width, options_.height, maker_->draw(snapshot, options_));
    } catch (...) {
      why_not_ = std::current_exception();
    }
  }
  void keep() {
    if (why_not_) std::rethrow_exception(why_not_);
    if (video_) video_->keep();
  }

 private:
  std::filesystem::path file_;
  const DrawnScene& drawn_;
  PictureOptions options_;
  std::optional<PictureMaker> maker_;
  std::optional<VideoFile> video_;
  std::exception_ptr why_not_;
};

}  // namespace

// All colours except that of the difference between two models, which only the viewer computes.
std::vector<std::string> tissue_colours() {
  std::vector<std::string> names;
  for (const std::string_view name : kTissueColours) {
    if (name != kTissueColours[static_cast<std::size_t>(TissueColour::difference)]) names.emplace_back(name);
  }
  return names;
}

Progress progress_on_terminal() {
  const auto start = std::chrono::steady_clock::now();
  const bool terminal = isatty(STDERR_FILENO) != 0;
  return [start, terminal, last = start](const std::string& text) mutable {
    device::stop_if_asked();
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
  const std::string text =
      read_text(command.scene);  // now, because the file may be edited during the session
  if (!command.device.empty()) use_device(scene, command.device);
  Outputs outputs;
  ask_outputs(command, scene, outputs);
  const Progress progress = progress_on_terminal();
  const auto real = open_real_device(scene);  // before the build, which may take long
  BuiltScene built = build_scene(scene, progress);
  end_progress();
  note_relaxation(scene, built, command.relaxation == "apart");
  print_notes(built);
  // Before this line a signal ends the program at once, because there is nothing to keep.
  const device::StopOnSignal stop;
  if (real) {
    std::fprintf(stderr, "note: %s\n", place_real_device(scene, *built.world, *real).c_str());
    await_free_tool(scene, *built.world, *built.state, *real, progress);
    end_progress();
    std::fprintf(stderr, "note: in touch now; Ctrl-C ends the session and keeps it\n");
  }
  const bool realtime = command.realtime || real;
  const auto kept = open_black_box_file(command.black_box, command.scene, realtime, scene.rate_hz);
  const bool paged = !command.report.folder.empty();
  SessionOptions options{.seconds = command.seconds,
                         .realtime = command.realtime,
                         .real_device = real.get(),
                         .keep_rows = !command.trace.empty() || !command.plot.empty() || paged,
                         .keep_recording = !command.record.empty(),
                         .keep_clearance = !command.plot.empty() || paged,
                         .between_samples = kBetweenSamples,
                         .between_every_tick = !command.trace.empty(),
                         .keep_picture = !command.picture.empty() || paged,
                         .measure_error = command.samples != "0",
                         .reference = command.reference == "full" ? Reference::full : Reference::quick,
                         .start_ticks = command.start_ticks,
                         .progress = progress,
                         .async_relaxation = command.relaxation == "apart",
                         .black_box = kept ? &kept->box() : nullptr};
  const std::string title = scene.title.empty() ? command.scene.stem().string() : scene.title;
  std::optional<DrawnScene> drawn;
  std::optional<RunVideo> video;
  if (!command.picture.empty() || !command.video.empty()) {
    drawn = drawn_scene(scene, built, title);
    TissueView tissue(*drawn, glm::dvec3(0.0));
    tissue.set(view_of(command));
    options.picture_points = tissue.asked();
  }
  if (!command.video.empty()) {
    if (real) throw std::runtime_error("--video needs a simulated device; add --device premium-1.5");
    drawn->path_m = places_along(*scene_path(scene));
    video.emplace(command.video, *drawn, view_of(command));
    options.on_frame = [&video](const Snapshot& snapshot) { video->add(snapshot); };
  }
  SessionResult result = run_session(scene, built, options);
  end_progress();
  const int signal = result.end == device::ServoEnd::stopped ? device::stop_signal() : 0;
  outputs.attempt([&kept] {
    if (kept) print_fault(*kept);
  });

  using Path = std::filesystem::path;
  outputs.write("trace", command.trace, [&](const Path& file) {
    save_trace(file, result.rows, pair_columns(*built.world, result.between));
  });
  outputs.write("recording", command.record, [&](const Path& file) {
    save_recording(
        file, {std::filesystem::absolute(command.scene), text, result.dt_s, scene_limits(scene),
               options.async_relaxation, result.state_hash, result.start_m, result.recording, result.edits});
  });
  const nlohmann::ordered_json report =
      command.json.empty() && !paged ? nullptr : run_report(scene, built, result);
  outputs.write_json(command.json, report);
  outputs.write("plot", command.plot, [&](const Path& file) {
    const auto objects =
        plotted_objects(drawn_scene(scene, built, title), result.rows, result.object_force_N);
    save_session_plot(file, result.rows, objects, title, {.near = result.clearance, .period_s = result.dt_s});
  });
  outputs.write("surface", command.save_surface, [&](const Path& file) {
    if (lower_ending(file) != ".glb") return save_surfaces(file, built);
    Snapshot now;
    fill_moved(*built.world, *built.state, now);
    save_glb(file, drawn_scene(scene, built, title), now);
  });
  outputs.attempt([&] {
    if (command.save_volume.empty()) return;
    for (const Path& file : save_volumes(command.save_volume, scene, built)) outputs.wrote("volume", file);
  });
  outputs.write("picture", command.picture, [&](const Path& file) {
    PictureOptions picture;
    picture.view = view_of(command);
    save_picture(file, *drawn, *result.moment, picture);
  });
  outputs.write("video", command.video, [&](const Path&) { video->keep(); });
  outputs.attempt([&] {
    if (paged) write_report(outputs, command.report, run_page(scene, built, result, report, title), report);
  });
  fmt::print(outputs.words(), "{}", run_summary(built, result));
  outputs.say_files();
  if (signal != 0) {
    return outputs.say_stopped(
        signal, fmt::format("{:.2f} s of {:.2f} s", static_cast<double>(result.ticks) * result.dt_s,
                            static_cast<double>(result.planned_ticks) * result.dt_s));
  }
  return result.end == device::ServoEnd::lost || outputs.failed() ? 1 : 0;
}

int replay(const ReplayCommand& command) {
  Outputs outputs;
  outputs.ask_json(command.json);
  const Recording recording = load_recording(command.recording);
  const device::StopOnSignal stop;
  const ReplayResult result = replay(recording, progress_on_terminal());
  end_progress();
  const int signal = device::stop_signal();
  const bool whole = result.replayed_ticks == result.ticks;
  nlohmann::ordered_json j = report_head("replay");
  j["ticks"] = result.ticks;
  j["replayed_ticks"] = result.replayed_ticks;
  j["state_hash"] = fmt::format("{:016x}", result.state_hash);
  j["equal"] =
      whole || !result.equal ? nlohmann::ordered_json(result.equal) : nlohmann::ordered_json(nullptr);
  if (!result.equal) j["parts_at_tick"] = result.first_difference;
  outputs.write_json(command.json, j);
  if (!result.equal) {
    fmt::print(outputs.words(), "parts at tick {} of {}: this build does not feel what was recorded\n",
               result.first_difference, result.ticks);
  } else if (whole) {
    fmt::print(outputs.words(), "equal: {} ticks, state hash {:016x}\n", result.ticks, result.state_hash);
  } else {
    fmt::print(outputs.words(), "equal so far: {} of {} ticks\n", result.replayed_ticks, result.ticks);
  }
  if (!whole) {
    return outputs.say_stopped(
        signal,
        fmt::format("{:.2f} s of {:.2f} s", static_cast<double>(result.replayed_ticks) * recording.dt_s,
                    static_cast<double>(result.ticks) * recording.dt_s));
  }
  return result.equal && !outputs.failed() ? 0 : 1;
}

}  // namespace hybrid
