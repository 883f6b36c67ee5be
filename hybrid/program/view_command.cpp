// SPDX-License-Identifier: GPL-3.0-or-later
// The viewer: a window, and a session on a thread of its own (live_session.h).
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <utility>

#include "device/loop/stop_signal.h"
#include "hybrid/base/thread_time.h"
#include "hybrid/program/commands.h"
#include "hybrid/program/model_difference.h"
#include "hybrid/program/outputs.h"
#include "hybrid/program/view_files.h"
#include "hybrid/program/view_watches.h"
#include "hybrid/program/viewed_scene.h"
#include "hybrid/session/live_session.h"
#include "hybrid/session/real_device.h"
#include "hybrid/window/frame_meter.h"
#include "hybrid/window/glfw_library.h"
#include "hybrid/window/video.h"
#include "hybrid/window/view_script.h"
#include "hybrid/window/window.h"

namespace hybrid {
namespace {

constexpr int kScriptFrames_per_s = 30;
constexpr double kScriptFrame_s = 1.0 / kScriptFrames_per_s;  // session time of one frame of a scripted view

std::filesystem::path frame_file(const std::filesystem::path& folder, std::uint64_t n) {
  return folder / fmt::format("frame-{:05}.png", n);
}

// Converts the window's input to a request for the session.
PlayRequest request_of(const WindowInput& input) {
  return {.dragging = input.dragged_goal_m.has_value(),
          .paused = input.paused,
          .speed = input.speed,
          .restarts = input.restarts,
          .single_ticks = input.single_ticks,
          .asked = input.asked,
          .goal_m = input.dragged_goal_m.value_or(glm::dvec3(0.0))};
}

SessionNotes notes_of(const Player& player, double t_s, const std::string& message,
                      const std::optional<ChangeEffect>& effect) {
  return {.real_device = player.is_real(),
          .recorded_s = t_s,
          .refused_edits = player.refused_edits(),
          .unseen_ticks = player.unseen_ticks(),
          .message = message,
          .effect = effect};
}

// The changes that the second scene has and the first one lacks.
std::string changes_between(const ViewedScene& before, const ViewedScene& after) {
  const auto since = static_cast<std::ptrdiff_t>(before.changes.size());
  return fmt::format("{}", fmt::join(after.changes.begin() + since, after.changes.end(), ", "));
}

// Shows the scene in which the session goes on. The one before is kept until the forces of both are compared.
ChangeEffect show_changed(Window& window, std::unique_ptr<ViewedScene>& viewed,
                          std::unique_ptr<ViewedScene> next, ChangeMade made, ChangeComparison& comparison) {
  made.effect.words = changes_between(*viewed, *next);
  window.add_ticks(viewed->player->samples());
  window.show_scene(next->drawn, made.effect.t_s);
  next->player = std::move(viewed->player);
  std::swap(viewed, next);
  comparison.begin(std::move(next), *viewed, std::move(made.after));
  return std::move(made.effect);
}

ViewScript read_script(const std::filesystem::path& file, const DrawnScene& drawn) {
  return file.empty() ? ViewScript() : ViewScript(text_of(file), file.string(), drawn);
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

// Refuses a video that cannot be written, before the scene is built.
void ask_video(const ViewCommand& command) {
  if (command.video.empty()) return;
  if (!command.frames)
    throw std::runtime_error("--video needs --frames N, the number of frames of the video");
  Outputs().ask("--video", command.video, {".mp4", ".mkv", ".webm"});
  require_ffmpeg();
}

void say_error(ModelDifference& difference, ViewFiles& files) {
  if (const std::string error = difference.take_error(); !error.empty())
    files.say("The models are not compared: " + error);
}

void leave_the_past(Window& window) {
  window.act({.verb = ViewVerb::look_back, .numbers = {0.0}});
}

// Plays frames that each cover a fixed time, so that the pictures are the same on any machine. Returns the
// exit status.
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
    try {
      if (auto next = changer.wait(*viewed)) {
        ChangeMade made = player.change_scene(next->scene, next->built, next->drawn, next->text);
        request.asked = nullptr;  // the points belong to the scene before
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
      leave_the_past(window);
    }
    const bool shows_past = back && !input.go_on;
    if (!shows_past) past.forget();  // kept states come and go
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

// The window of a session, with the user's files, script and reloads of the scene.
struct LiveWindow {
  const ViewCommand& command;
  Window& window;
  ViewFiles files;
  ViewScript script;
  SceneReload reload;
  SceneChanger changer;
  ModelDifference difference;
  ChangeComparison comparison{};
  FrameMeter meter{};
  std::string lost{};  // why the window cannot be shown any more; empty: it can
  std::optional<ChangeEffect> effect{};
  std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();
};

SessionNotes notes_of(const LiveWindow& live, const Player& player, double t_s) {
  SessionNotes notes = notes_of(player, t_s, live.files.message(), live.effect);
  notes.building = live.changer.building();
  notes.comparing = live.difference.in_words();
  if (!notes.building.empty()) notes.message = notes.building + "; the session goes on meanwhile";
  if (live.reload.loading()) notes.message = "loading the scene again; the session goes on meanwhile";
  PastView::add_notes(player, t_s, notes);
  if (!live.reload.error().empty())
    notes.error = live.reload.error() + "\nThe session goes on with the scene as it was.";
  return notes;
}

// Goes on in a changed scene when it is built. Returns whether it did.
bool take_changed_scene(LiveWindow& live, std::unique_ptr<ViewedScene>& viewed, LiveSession& session,
                        const PlayRequest& request) {
  try {
    auto next = live.changer.poll(*viewed);
    if (next == nullptr) return false;
    ChangeMade made;
    session.change(request, [&] {
      made = viewed->player->change_scene(next->scene, next->built, next->drawn, next->text);
    });
    live.effect = show_changed(live.window, viewed, std::move(next), std::move(made), live.comparison);
    return true;
  } catch (const std::exception& e) {
    live.files.say(std::string("The scene is as it was: ") + e.what());
    return false;
  }
}

void go_back(LiveWindow& live, LiveSession& session, const PlayRequest& request, Player& player,
             std::size_t kept) {
  try {
    session.change(request, [&] { player.go_back(kept); });
    leave_the_past(live.window);
  } catch (const std::exception& e) {
    live.files.say(std::string("The session goes on as it was: ") + e.what());
  }
}

// Keeps the session's state when it is time. The session stands still for at most one part in 20 of the time.
void keep_state(LiveSession& session, const PlayRequest& request, Player& player, double now_s,
                std::chrono::steady_clock::time_point& next) {
  constexpr int rest = 19;
  const auto begin = std::chrono::steady_clock::now();
  if (begin < next || request.paused || !player.keeps_at(now_s)) return;
  session.between_ticks(request, [&] { player.keep_state(); });
  const auto end = std::chrono::steady_clock::now();
  next = end + rest * (end - begin);
}

// Runs the window on this thread and the session on another. Ends when the window closes, or when a changed
// scene is ready in `next`. Returns the device's events.
device::ServoReport play_live(LiveWindow& live, std::unique_ptr<ViewedScene>& viewed, BlackBox& box,
                              std::unique_ptr<ViewedScene>& next) {
  LiveSession session(*viewed->player, box);
  Player& player = *viewed->player;
  Snapshot shown;
  PressWatch watch;
  PastView past;
  RestWish rest;
  auto keep_next = std::chrono::steady_clock::now();
  bool open = true;
  while (open && !session.ended() && next == nullptr) {
    live.meter.begin(session.processor_time_s());
    live.script.play(std::chrono::duration<double>(std::chrono::steady_clock::now() - live.start).count(),
                     live.window);
    const WindowInput input = live.window.take_input();
    PlayRequest request = request_of(input);
    for (const Edit& edit : input.edits) player.edit(edit);
    if (player.is_real() && !input.changes.empty())
      live.files.say("The scene is as it was: with a real device it does not change while it is felt.");
    for (const SceneChange& change : input.changes) {
      if (!player.is_real()) live.changer.ask(change);
    }
    if (take_changed_scene(live, viewed, session, request)) {
      live.difference.forget();
      request.asked = nullptr;
      watch = {};
    }
    rest.follow(input.compares_with_rest, player, live.files,
                [&](const auto& change) { session.between_ticks(request, change); });
    if (auto forces = live.comparison.poll()) live.effect->forces = forces;
    const auto back = PastView::shown(player, shown.t_s, input.back_s);
    if (back && input.go_on) {
      go_back(live, session, request, player, *back);
      request.asked = nullptr;
    }
    const bool shows_past = back && !input.go_on;
    if (!shows_past) past.forget();  // kept states come and go
    request.paused = request.paused || shows_past;
    session.ask(request);
    if (!shows_past) keep_state(session, request, player, shown.t_s, keep_next);
    session.shown(viewed->drawn, shown);
    shown.presses = watch.presses(input, request, player, session, shown.tick);
    if (input.comparison) live.difference.ask(*input.comparison, *viewed, shown);
    shown.difference = live.difference.found();
    say_error(live.difference, live.files);
    live.window.add_ticks(player.samples(), player.at_rest());
    try {
      open =
          live.window.frame(shows_past ? past.snapshot(player, *back, request.asked.get(), shown.difference)
                                       : std::as_const(shown),
                            notes_of(live, player, shown.t_s));
    } catch (const std::exception& e) {
      live.lost = e.what();
      break;
    }
    live.files.save_what_was_asked(live.window, input, *viewed, shown, [&] { return session.hold(request); });
    if (input.reload) live.reload.ask();
    if (!player.is_real()) next = live.reload.poll();
    live.meter.end(session.processor_time_s());
  }
  live.comparison.cancel();
  return session.stop();
}

// Plays a scene, and the new scene each time that the scene's file has changed.
device::ServoReport play_scenes(LiveWindow& live, std::unique_ptr<ViewedScene> viewed, BlackBox& box) {
  for (;;) {
    std::unique_ptr<ViewedScene> next;
    device::ServoReport report = play_live(live, viewed, box, next);
    if (next == nullptr) {
      if (!live.files.save_at_end(*viewed)) report.messages.emplace_back("the session was not recorded");
      return report;
    }
    live.changer.cancel();
    live.difference.forget();
    live.effect.reset();
    live.window.show_scene(next->drawn);
    viewed = std::move(next);
    print_notes(viewed->built);
    if (live.files.message().empty()) live.files.say("The scene was loaded again.");
  }
}

}  // namespace

int view(const ViewCommand& command) {
  std::unique_ptr<ViewedScene> viewed = read_viewed_scene(command);
  Scene& scene = viewed->scene;
  // --frames writes reproducible pictures. With a real device they would not be reproducible.
  if (command.frames && scene.real_device) {
    throw SceneError(scene.file, scene.real_device->place,
                     "--frames needs a simulated device; add --device premium-1.5");
  }
  ask_video(command);
  const GlfwLibrary display;  // a missing display is refused before the scene is built
  if (!command.out.empty()) std::filesystem::create_directories(command.out);
  const auto real = open_real_device(scene);
  build_viewed_scene(command, *viewed, progress_on_terminal());
  end_progress();
  print_notes(viewed->built);
  ViewScript script = read_script(command.script, viewed->drawn);
  // With --frames the pictures show only the scene, unless a script acts as the window's user.
  Window window(viewed->drawn, {.width = command.width,
                                .height = command.height,
                                .visible = !command.frames || (command.out.empty() && command.video.empty()),
                                .panels = !command.frames || !command.script.empty()});
  const device::StopOnSignal stop;
  if (real) {
    const BuiltScene& built = viewed->built;
    std::fprintf(stderr, "note: %s\n", place_real_device(scene, *built.world, *real).c_str());
    await_free_tool(scene, *built.world, *built.state, *real, progress_on_terminal());
    end_progress();
  }
  viewed->player = std::make_unique<Player>(scene, viewed->built, viewed->drawn, real.get());
  if (command.frames) {
    viewed->player->relax_at_once();
    return play_frames(command, std::move(viewed), window, script);
  }
  const auto kept = open_black_box_file({}, command.scene, true, scene.rate_hz);
  LiveWindow live{command,
                  window,
                  ViewFiles(command),
                  std::move(script),
                  SceneReload(command, viewed->text),
                  SceneChanger(command),
                  ModelDifference(command, true)};
  const device::ServoReport report = play_scenes(live, std::move(viewed), kept->box());
  fmt::print("{}\n", live.meter.in_words());
  if (!live.lost.empty()) fmt::print(stderr, "the session ended: {}\n", live.lost);
  print_fault(*kept);
  for (const std::string& message : report.messages) std::fprintf(stderr, "device: %s\n", message.c_str());
  if (report.end == device::ServoEnd::stopped) return exit_status_of_signal(device::stop_signal());
  return report.end == device::ServoEnd::lost || !live.lost.empty() ? 1 : 0;
}

}  // namespace hybrid
