// SPDX-License-Identifier: GPL-3.0-or-later
// The viewer: a window and a session, each on a thread of its own. The session publishes snapshots and the
// figures of every tick, and takes goals and edits. Neither waits for the other.
#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <thread>

#include "device/loop/servo_loop.h"
#include "device/loop/stop_signal.h"
#include "hybrid/base/flush_to_zero.h"
#include "hybrid/base/triple_buffer.h"
#include "hybrid/program/commands.h"
#include "hybrid/program/outputs.h"
#include "hybrid/program/view_files.h"
#include "hybrid/program/viewed_scene.h"
#include "hybrid/session/real_device.h"
#include "hybrid/snapshot/merge_live_surface.h"
#include "hybrid/window/frame_meter.h"
#include "hybrid/window/video.h"
#include "hybrid/window/view_script.h"
#include "hybrid/window/window.h"

namespace hybrid {
namespace {

constexpr double kSnapshotEvery_s = 1.0 / 60.0;  // session time between two pictures of a live view
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

// Shows the scene in which the session goes on, and drops the one before.
void show_changed(Window& window, std::unique_ptr<ViewedScene>& viewed, std::unique_ptr<ViewedScene> next,
                  ChangeEffect& effect) {
  effect.words = changes_between(*viewed, *next);
  window.add_ticks(viewed->player->samples());
  window.show_scene(next->drawn, effect.t_s);
  next->player = std::move(viewed->player);
  viewed = std::move(next);
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
  std::optional<ChangeEffect> effect;
  FrameMeter meter;
  std::optional<VideoFile> video;
  double ahead_s = 0.0;  // simulated time that the frames are ahead of the ticks
  for (std::uint64_t n = 0; n < *command.frames; ++n) {
    meter.begin();
    script.play(static_cast<double>(n) * kScriptFrame_s, window);
    const WindowInput input = window.take_input();
    PlayRequest request = request_of(input);
    for (const Edit& edit : input.edits) player.edit(edit);
    for (const SceneChange& change : input.changes) changer.ask(change);
    try {
      if (auto next = changer.wait(*viewed)) {
        effect = player.change_scene(next->scene, next->built, next->drawn, next->text);
        request.asked = nullptr;  // the points belong to the scene before
        show_changed(window, viewed, std::move(next), *effect);
      }
    } catch (const std::exception& e) {
      files.say(std::string("The scene is as it was: ") + e.what());
    }
    for (ahead_s += kScriptFrame_s; ahead_s > 0.5 / player.rate_hz(); ahead_s -= 1.0 / player.rate_hz()) {
      if (drag) {
        request.dragging = true;
        request.goal_m = drag->position(player.t_s());
      }
      player.step(request);
    }
    player.snapshot(snapshot, request.asked.get());
    snapshot.presses = input.wants_presses ? player.presses() : std::vector<PairPress>();
    meter.end_session();
    window.add_ticks(player.samples());
    if (!window.frame(snapshot, notes_of(player, snapshot.t_s, files.message(), effect))) break;
    meter.end();
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

// The session on its own thread, while a window shows it.
class LiveSession {
 public:
  LiveSession(ViewedScene& viewed, BlackBox& box)
      : player_(*viewed.player), relaxation_(player_.go_live(1.0 / kSnapshotEvery_s)), box_(box) {
    player_.snapshot(snapshots_.back());
    snapshots_.publish();
    thread_ = std::jthread([this] { serve(); });
  }
  LiveSession(const LiveSession&) = delete;
  LiveSession& operator=(const LiveSession&) = delete;
  LiveSession(LiveSession&&) = delete;
  LiveSession& operator=(LiveSession&&) = delete;
  ~LiveSession() { stop(); }

  void ask(const PlayRequest& request) {
    asked_ = request.asked;
    requests_.back() = request;
    requests_.publish();
  }
  void shown(const DrawnScene& drawn, Snapshot& snapshot) {
    relaxation_->ask(asked_);
    merge_live_surface(drawn, snapshots_.take(), relaxation_->tissue(), asked_.get(), snapshot);
  }
  // Waits until the servo thread leaves the state alone. Returns false if it does not answer.
  bool hold(PlayRequest request) {
    request.hold = ++holds_;
    ask(request);
    for (int n = 0; n < kMostWaits && !ended_; ++n) {
      if (player_.held() == request.hold) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return ended_;
  }
  // The session goes on in another scene. It stands still meanwhile. Throws std::exception if that is not
  // possible.
  ChangeEffect change_scene(PlayRequest request, ViewedScene& next) {
    if (!hold(request)) throw std::runtime_error("the session does not answer; try again");
    relaxation_.reset();
    request.asked = nullptr;  // the points belong to the scene before
    const auto go_on = [&] {
      relaxation_ = player_.relaxation_thread(1.0 / kSnapshotEvery_s);
      ask(request);
    };
    try {
      const ChangeEffect effect = player_.change_scene(next.scene, next.built, next.drawn, next.text);
      go_on();
      for (int n = 0; n < kMostWaits && !ended_ && snapshots_.take().scene != player_.scene_number(); ++n)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      return effect;
    } catch (...) {
      go_on();
      throw;
    }
  }
  [[nodiscard]] bool ended() const { return ended_; }
  device::ServoReport stop() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
    return report_;
  }

 private:
  static constexpr int kMostWaits = 500;  // waits of 1 ms each

  device::ServoAnswer answer(const device::ServoInput& input) {
    const ScopedFlushToZero flushed;
    const bool go_on = !stop_.load(std::memory_order_relaxed);
    if (!go_on) return {.go_on = false, .skip = true};
    const bool ticked = player_.advance(requests_.take(), input);
    if (ticked) box_.add(black_box_row(input, player_.felt(), player_.ticks() - 1, player_.state()));
    if (ticked || player_.edited()) publish(ticked);
    return {.force_N = player_.felt().force_N, .skip = !ticked};
  }
  // Publishes a snapshot, at most 60 times a second of real time.
  void publish(bool ticked) {
    const auto now = std::chrono::steady_clock::now();
    if (ticked && now < next_) return;
    next_ = now + std::chrono::microseconds(static_cast<int>(1e6 * kSnapshotEvery_s));
    player_.shown();
    player_.snapshot(snapshots_.back(), requests_.take().asked.get());
    snapshots_.publish();
  }
  void serve() {
    auto tick = [this](const device::ServoInput& input) { return answer(input); };
    try {
      report_ = device::run_servo(
          player_.device(),
          {.rate_hz = player_.rate_hz(), .realtime = true, .deadline_s = player_.deadline_s()}, tick);
    } catch (const std::exception& e) {
      report_.end = device::ServoEnd::lost;
      report_.messages.emplace_back(e.what());
    }
    ended_ = true;
  }

  Player& player_;
  std::unique_ptr<RelaxationThread> relaxation_;
  BlackBox& box_;
  TripleBuffer<Snapshot> snapshots_;
  TripleBuffer<PlayRequest> requests_;
  std::shared_ptr<const AskedPoints> asked_;  // of the last request
  std::atomic<bool> stop_{false}, ended_{false};
  std::chrono::steady_clock::time_point next_{};
  std::uint32_t holds_ = 0;
  device::ServoReport report_;
  std::jthread thread_;
};

// Keeps the forces between objects for the window's list. To compute them the session is held for a moment:
// a simulated hand does not notice, because held time does not count. A real hand would, so with a real
// device they are computed only while the session is paused.
class PressWatch {
 public:
  const std::vector<PairPress>& presses(const WindowInput& input, const PlayRequest& request,
                                        const Player& player, LiveSession& session, std::uint64_t tick) {
    const auto now = std::chrono::steady_clock::now();
    if (!input.wants_presses || (player.is_real() && !request.paused)) {
      presses_.clear();
      tick_ = kNever;
    } else if (tick != tick_ && now >= next_ && session.hold(request)) {
      presses_ = player.presses();
      session.ask(request);
      tick_ = tick;
      const auto end = std::chrono::steady_clock::now();
      next_ = end + std::max<std::chrono::steady_clock::duration>(kEvery, kRest * (end - now));
    }
    return presses_;
  }

 private:
  static constexpr std::uint64_t kNever = ~std::uint64_t{0};
  static constexpr std::chrono::milliseconds kEvery{200};  // least time between two updates of the list
  static constexpr int kRest = 19;  // the session is held for at most one part in 20 of the time
  std::vector<PairPress> presses_;
  std::uint64_t tick_ = kNever;  // of presses_
  std::chrono::steady_clock::time_point next_{};
};

// The window of a session, with the user's files, script and reloads of the scene.
struct LiveWindow {
  const ViewCommand& command;
  Window& window;
  ViewFiles files;
  ViewScript script;
  SceneReload reload;
  SceneChanger changer;
  std::optional<ChangeEffect> effect{};
  std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();
};

SessionNotes notes_of(const LiveWindow& live, const Player& player, double t_s) {
  SessionNotes notes = notes_of(player, t_s, live.files.message(), live.effect);
  notes.building = live.changer.building();
  if (!notes.building.empty()) notes.message = notes.building + "; the session goes on meanwhile";
  if (live.reload.loading()) notes.message = "loading the scene again; the session goes on meanwhile";
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
    live.effect = session.change_scene(request, *next);
    show_changed(live.window, viewed, std::move(next), *live.effect);
    return true;
  } catch (const std::exception& e) {
    live.files.say(std::string("The scene is as it was: ") + e.what());
    return false;
  }
}

// Runs the window on this thread and the session on another. Ends when the window closes, or when a changed
// scene is ready in `next`. Returns the device's events.
device::ServoReport play_live(LiveWindow& live, std::unique_ptr<ViewedScene>& viewed, BlackBox& box,
                              std::unique_ptr<ViewedScene>& next) {
  LiveSession session(*viewed, box);
  Player& player = *viewed->player;
  Snapshot shown;
  PressWatch watch;
  bool open = true;
  while (open && !session.ended() && next == nullptr) {
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
      request.asked = nullptr;
      watch = {};
    }
    session.ask(request);
    session.shown(viewed->drawn, shown);
    shown.presses = watch.presses(input, request, player, session, shown.tick);
    live.window.add_ticks(player.samples());
    open = live.window.frame(shown, notes_of(live, player, shown.t_s));
    live.files.save_what_was_asked(live.window, input, *viewed, shown, [&] { return session.hold(request); });
    if (input.reload) live.reload.ask();
    if (!player.is_real()) next = live.reload.poll();
  }
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
  if (!command.out.empty()) std::filesystem::create_directories(command.out);
  const auto real = open_real_device(scene);
  build_viewed_scene(command, *viewed, progress_on_terminal());
  end_progress();
  print_notes(viewed->built);
  ViewScript script = read_script(command.script, viewed->drawn);
  // With --frames the pictures show only the scene, unless a script acts as the window's user.
  Window window(viewed->drawn, {.visible = !command.frames || (command.out.empty() && command.video.empty()),
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
                  SceneChanger(command)};
  const device::ServoReport report = play_scenes(live, std::move(viewed), kept->box());
  print_fault(*kept);
  for (const std::string& message : report.messages) std::fprintf(stderr, "device: %s\n", message.c_str());
  if (report.end == device::ServoEnd::stopped) return exit_status_of_signal(device::stop_signal());
  return report.end == device::ServoEnd::lost ? 1 : 0;
}

}  // namespace hybrid
