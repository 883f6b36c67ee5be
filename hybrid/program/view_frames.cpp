// SPDX-License-Identifier: GPL-3.0-or-later
// Reproducible pictures and videos (--frames).
#include <fmt/format.h>

#include <cstdio>
#include <utility>

#include "device/loop/stop_signal.h"
#include "hybrid/base/thread_time.h"
#include "hybrid/program/view_files.h"
#include "hybrid/program/view_steps.h"
#include "hybrid/session/outputs.h"
#include "hybrid/window/frame_meter.h"
#include "hybrid/window/video.h"

namespace hybrid {
namespace {

constexpr int kScriptFrames_per_s = 30;
constexpr double kScriptFrame_s = 1.0 / kScriptFrames_per_s;  // session time of one frame of a scripted view

std::filesystem::path frame_file(const std::filesystem::path& folder, std::uint64_t n) {
  return folder / fmt::format("frame-{:05}.png", n);
}

// Adds the last frame to the video of --video, if there is one.
void add_to_video(const ViewCommand& command, Window& window, std::optional<VideoFile>& video) {
  if (command.video.empty()) return;
  const FramePicture frame = window.picture();
  if (!video) video.emplace(command.video, frame.width, frame.height, kScriptFrames_per_s);
  video->add(frame.width, frame.height, frame.rgb);
}

void keep_video(const ViewCommand& command, std::optional<VideoFile>& video) {
  if (!video) return;
  video->keep();
  fmt::print("video: {}\n", command.video.string());
}

}  // namespace

int play_frames(const ViewCommand& command, std::unique_ptr<ViewedScene> viewed, Window& window,
                ViewScript& script) {
  std::shared_ptr<const device::Path> drag;
  if (!command.drag.empty()) drag = device::make_path(device::CsvPath{.file = command.drag});
  Player& player = *viewed->player;
  Snapshot snapshot;
  ViewFiles files(command);
  SceneChanger changer(command);
  ChangeComparison comparison;
  ModelDifference difference(command, false);
  std::optional<ChangeEffect> effect;
  PastView past;
  RestWish rest;
  FrameMeter meter;
  std::optional<VideoFile> video;
  double session_s = 0.0;  // processor time of the session
  double ahead_s = 0.0;    // simulated time that the frames are ahead of the ticks
  for (std::uint64_t n = 0; n < *command.frames; ++n) {
    meter.begin(session_s);
    script.play(static_cast<double>(n) * kScriptFrame_s, window);
    const WindowInput input = window.take_input();
    PlayRequest request = request_of(input);
    for (const Edit& edit : input.edits) player.edit(edit);
    for (const SceneChange& change : input.changes) changer.ask(change);
    for (const std::filesystem::path& file : input.opened) {
      if (kind_of_file(file) == DroppedKind::mesh) {
        changer.add_mesh(file);
      } else if (kind_of_file(file) == DroppedKind::scene) {
        files.say_error("Frames show one scene. Without --frames, " + file.string() + " would be opened.");
      } else {
        files.say_error(why_not_opened(file));
      }
    }
    try {
      if (auto next = changer.wait(*viewed)) {
        ChangeMade made = player.change_scene(next->scene, next->built, next->drawn, next->text);
        request.asked = nullptr;  // the points belong to the previous scene
        effect = show_changed(window, viewed, std::move(next), std::move(made), comparison);
        effect->forces = comparison.wait();  // so that frames are reproducible
        difference.forget();
      }
    } catch (const std::exception& e) {
      files.say(std::string("The scene is as it was: ") + e.what());
    }
    rest.follow(input.compares_with_rest, player, files, [](const auto& change) { change(); });
    const auto back = PastView::shown(player, player.t_s(), input.back_s);
    if (back && input.go_on) {
      player.go_back(*back);
      PastView::leave(window);
    }
    const bool shows_past = back && !input.go_on;
    if (!shows_past) past.forget();  // the kept states change meanwhile
    request.paused = request.paused || shows_past;
    const double session_began_s = thread_time_s();
    for (ahead_s += kScriptFrame_s; ahead_s > 0.5 / player.rate_hz(); ahead_s -= 1.0 / player.rate_hz()) {
      if (drag) {
        request.dragging = true;
        request.goal_m = drag->position(player.t_s());
      }
      player.step(request);
    }
    player.keep_state();
    player.snapshot(snapshot, request.asked.get());
    snapshot.presses = input.wants_presses && !shows_past ? player.presses() : std::vector<PairPress>();
    if (input.comparison) {
      difference.ask(*input.comparison, *viewed, snapshot);
      difference.wait();  // so that frames are reproducible
      say_error(difference, files);
    }
    snapshot.difference = difference.found();
    SessionNotes notes = notes_of(player, snapshot.t_s, files.message(), effect);
    PastView::add_notes(player, snapshot.t_s, notes);
    if (input.wants_boxes && !shows_past) notes.boxes = map_boxes(*viewed->built.world, player.state());
    const Snapshot& seen = shows_past ? past.snapshot(player, *back, request.asked.get(), snapshot.difference)
                                      : std::as_const(snapshot);
    session_s += thread_time_s() - session_began_s;
    window.add_ticks(player.samples(), player.at_rest());
    if (!window.frame(seen, notes)) break;
    meter.end(session_s);
    if (!command.out.empty()) save_frame(window, frame_file(command.out, n));
    add_to_video(command, window, video);
    files.save_what_was_asked(window, input, *viewed, snapshot, [] { return true; });
    if (const int signal = device::stop_signal(); signal != 0) {
      keep_video(command, video);
      fmt::print(stderr, "stopped by {} after {} of {} frames{}{}\n", signal_in_words(signal), n + 1,
                 *command.frames, command.out.empty() ? "" : ", which are in ", command.out.string());
      return exit_status_of_signal(signal);
    }
  }
  if (!command.out.empty()) fmt::print("{} frames in {}\n", *command.frames, command.out.string());
  keep_video(command, video);
  fmt::print("{}\n", meter.in_words());
  return files.save_at_end(*viewed) ? 0 : 1;
}

}  // namespace hybrid
