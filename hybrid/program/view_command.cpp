// SPDX-License-Identifier: GPL-3.0-or-later
// The viewer: a window and a session, each on its own thread. The session publishes snapshots and takes
// goals; neither waits for the other.
#include <fmt/format.h>

#include <atomic>
#include <cmath>
#include <cstdio>
#include <glm/geometric.hpp>
#include <thread>

#include "device/loop/servo_loop.h"
#include "device/loop/stop_signal.h"
#include "device/simulated/simulated.h"
#include "hybrid/base/flush_to_zero.h"
#include "hybrid/base/triple_buffer.h"
#include "hybrid/program/commands.h"
#include "hybrid/program/outputs.h"
#include "hybrid/session/real_device.h"
#include "hybrid/session/relaxation_thread.h"
#include "hybrid/session/session.h"
#include "hybrid/snapshot/fill_snapshot.h"
#include "hybrid/snapshot/make_drawn_scene.h"
#include "hybrid/snapshot/merge_live_surface.h"
#include "hybrid/tick/tissue/async_relaxation.h"
#include "hybrid/view/window.h"

namespace hybrid {
namespace {

constexpr double kSnapshotEvery_s = 1.0 / 60.0;
constexpr double kScriptFrame_s = 1.0 / 30.0;  // session time of one frame of a scripted view

// Requests of the window to the session.
struct WindowRequest {
  bool dragging = false, paused = false;
  std::uint32_t restarts = 0;
  glm::dvec3 goal_m{0.0};
};

// Target of the simulated hand: the scene's path, or the goal of the mouse. The device reads it within a
// tick.
class SteeredPath final : public device::Path {
 public:
  explicit SteeredPath(std::shared_ptr<const device::Path> path) : path_(std::move(path)) {}
  [[nodiscard]] glm::dvec3 position(double t_s) const noexcept override {
    return dragged_ ? goal_m_ : path_->position(std::fmod(t_s - start_s_, path_->duration_s() + 1.0));
  }
  [[nodiscard]] double duration_s() const noexcept override { return path_->duration_s(); }
  [[nodiscard]] const std::vector<std::string>& notes() const noexcept override { return path_->notes(); }

  void drag_to(const glm::dvec3& goal_m) {
    dragged_ = true;
    goal_m_ = goal_m;
  }
  void restart(double now_s) {
    dragged_ = false;
    start_s_ = now_s;
  }

 private:
  std::shared_ptr<const device::Path> path_;
  bool dragged_ = false;
  glm::dvec3 goal_m_{0.0};
  double start_s_ = 0.0;
};

// The session's side. After a drag the tool stays at its last goal until a restart.
class Player {
 public:
  Player(const Scene& scene, BuiltScene& built, device::HapticDevice* real_device)
      : built_(built),
        path_(std::make_shared<SteeredPath>(scene_path(scene))),
        simulated_(real_device == nullptr ? scene_device(scene, path_) : nullptr),
        device_(real_device == nullptr ? *simulated_ : *real_device),
        rate_hz_(scene.rate_hz),
        dt_(1.0 / scene.rate_hz) {
    set_flush_to_zero();
    goal_m_ = device_.read().position_m;
    begin_session(scene, *built.world, *built.state, goal_m_);
  }

  TickResult tick(const WindowRequest& request, const device::DeviceState& input) {
    if (request.restarts != restarts_) {
      restarts_ = request.restarts;
      path_->restart(t_s());
    }
    // The mouse is faster than a hand: the goal follows it at most at the speed of a brisk hand.
    if (request.dragging) {
      const glm::dvec3 delta = request.goal_m - goal_m_;
      const double length = glm::length(delta), most = kHandSpeed_m_per_s * dt_;
      goal_m_ = length > most ? goal_m_ + delta * (most / length) : request.goal_m;
      path_->drag_to(goal_m_);
    }
    const TickResult felt = haptic_tick(*built_.world, *built_.state, input, dt_);
    if (!request.dragging) goal_m_ = felt.device_m;
    ++ticks_;
    return felt;
  }
  [[nodiscard]] BlackBoxRow row(const device::ServoInput& input, const TickResult& felt) const {
    return black_box_row(input, felt, ticks_ - 1, *built_.state);
  }
  [[nodiscard]] double t_s() const { return static_cast<double>(ticks_) * dt_; }
  [[nodiscard]] double rate_hz() const { return rate_hz_; }
  [[nodiscard]] double deadline_s() const { return built_.world->limits.deadline_s; }
  [[nodiscard]] device::HapticDevice& device() { return device_; }
  // One tick on this thread, without real time.
  TickResult step(const WindowRequest& request) {
    const TickResult felt = tick(request, device_.read());
    device_.write(felt.force_N, dt_);
    return felt;
  }
  void snapshot(const TickResult& felt, Snapshot& out) const {
    out.tick = built_.state->tick;
    out.t_s = t_s();
    out.device_m = felt.device_m;
    out.proxy_m = felt.proxy_m;
    out.force_N = felt.force_N;
    out.feel = built_.state->feel;
    out.tick_us = felt.tick_us;
    if (live_) {
      fill_moved_near(*built_.world, *built_.state, out);
    } else {
      fill_moved(*built_.world, *built_.state, out);
    }
  }
  // From now on a thread relaxes the tissue; the caller runs that thread.
  [[nodiscard]] std::unique_ptr<RelaxationThread> go_live() {
    live_ = true;
    start_async_relaxation(*built_.state, Arrival::thread);
    return std::make_unique<RelaxationThread>(*built_.world, built_.state->async, 1.0 / kSnapshotEvery_s);
  }

 private:
  static constexpr double kHandSpeed_m_per_s = 0.5;
  BuiltScene& built_;
  std::shared_ptr<SteeredPath> path_;
  std::unique_ptr<device::HapticDevice> simulated_;
  device::HapticDevice& device_;
  double rate_hz_, dt_;
  bool live_ = false;
  std::uint64_t ticks_ = 0;
  std::uint32_t restarts_ = 0;
  glm::dvec3 goal_m_{0.0};
};

// Places of the hand from the path's beginning to its end.
std::vector<glm::dvec3> places_along(const device::Path& path) {
  constexpr int steps = 500;
  std::vector<glm::dvec3> places;
  for (int n = 0; n <= steps; ++n) places.push_back(path.position(path.duration_s() * n / steps));
  return places;
}

std::filesystem::path frame_file(const std::filesystem::path& folder, std::uint64_t n) {
  return folder / fmt::format("frame-{:05}.png", n);
}

// Plays frames that each stand for a fixed stretch of session time, so that the pictures are reproducible on
// any machine. Returns the exit status.
int play_frames(const ViewCommand& command, Player& player, Window& window) {
  std::shared_ptr<const device::Path> drag;
  if (!command.drag.empty()) drag = device::make_path(device::CsvPath{.file = command.drag});
  Snapshot snapshot;
  for (std::uint64_t n = 0; n < *command.frames; ++n) {
    WindowRequest request;
    TickResult felt;
    for (double end = player.t_s() + kScriptFrame_s; player.t_s() < end;) {
      if (drag) {
        request.dragging = true;
        request.goal_m = drag->position(player.t_s());
      }
      felt = player.step(request);
    }
    player.snapshot(felt, snapshot);
    if (!window.frame(snapshot)) return 0;
    if (!command.out.empty()) window.save_frame(frame_file(command.out, n));
    if (const int signal = device::stop_signal(); signal != 0) {
      fmt::print(stderr, "stopped by {} after {} of {} frames{}{}\n", signal_in_words(signal), n + 1,
                 *command.frames, command.out.empty() ? "" : ", which are in ", command.out.string());
      return exit_status_of_signal(signal);
    }
  }
  if (!command.out.empty()) fmt::print("{} frames in {}\n", *command.frames, command.out.string());
  return 0;
}

// Runs the window on this thread and the session on another. Returns the device's events.
device::ServoReport play_live(const DrawnScene& drawn, Player& player, Window& window, BlackBox& box) {
  TripleBuffer<Snapshot> snapshots;
  TripleBuffer<WindowRequest> requests;
  std::atomic<bool> stop{false}, ended{false};
  device::ServoReport report;
  const std::unique_ptr<RelaxationThread> relaxation = player.go_live();
  std::jthread session([&] {
    double next = 0.0;
    auto tick = [&](const device::ServoInput& input) -> device::ServoAnswer {
      const ScopedFlushToZero flushed;
      const bool go_on = !stop.load(std::memory_order_relaxed);
      const WindowRequest& request = requests.take();
      if (request.paused || !go_on) return {.go_on = go_on, .skip = true};
      const TickResult felt = player.tick(request, input.device);
      box.add(player.row(input, felt));
      if (player.t_s() >= next) {
        next = player.t_s() + kSnapshotEvery_s;
        player.snapshot(felt, snapshots.back());
        snapshots.publish();
      }
      return {.force_N = felt.force_N};
    };
    try {
      report = device::run_servo(
          player.device(), {.rate_hz = player.rate_hz(), .realtime = true, .deadline_s = player.deadline_s()},
          tick);
    } catch (const std::exception& e) {
      report.end = device::ServoEnd::lost;
      report.messages.emplace_back(e.what());
    }
    ended = true;
  });
  WindowRequest request;
  Snapshot shown;
  do {
    const WindowInput input = window.take_input();
    request.dragging = input.dragged_goal_m.has_value();
    if (input.dragged_goal_m) request.goal_m = *input.dragged_goal_m;
    request.paused = input.paused;
    if (input.restart) ++request.restarts;
    requests.back() = request;
    requests.publish();
    merge_live_surface(drawn, snapshots.take(), relaxation->surfaces(), shown);
  } while (window.frame(shown) && !ended);
  stop = true;
  session.join();
  return report;
}

}  // namespace

int view(const ViewCommand& command) {
  Scene scene = load_scene(command.scene);
  if (!command.device.empty()) use_device(scene, command.device);
  // Frames are reproducible pictures, which a real device cannot give.
  if (command.frames && scene.real_device) {
    throw SceneError(scene.file, scene.real_device->place,
                     "--frames needs a simulated device; add --device premium-1.5");
  }
  if (!command.out.empty()) std::filesystem::create_directories(command.out);
  const auto real = open_real_device(scene);
  BuiltScene built = build_scene(scene, progress_on_terminal());
  end_progress();
  note_relaxation(scene, built, true);
  print_notes(built);
  DrawnScene drawn =
      drawn_scene(scene, built, scene.title.empty() ? command.scene.stem().string() : scene.title);
  if (!real) drawn.path_m = places_along(*scene_path(scene));
  Window window(drawn);
  const device::StopOnSignal stop;
  if (real) {
    std::fprintf(stderr, "note: %s\n", place_real_device(scene, *built.world, *real).c_str());
    await_free_tool(scene, *built.world, *built.state, *real, progress_on_terminal());
    end_progress();
  }
  Player player(scene, built, real.get());
  if (command.frames) {
    start_async_relaxation(*built.state, Arrival::counted);
    return play_frames(command, player, window);
  }
  const auto kept = open_black_box_file({}, command.scene, true, scene.rate_hz);
  const device::ServoReport report = play_live(drawn, player, window, kept->box());
  print_fault(*kept);
  for (const std::string& message : report.messages) std::fprintf(stderr, "device: %s\n", message.c_str());
  if (report.end == device::ServoEnd::stopped) return exit_status_of_signal(device::stop_signal());
  return report.end == device::ServoEnd::lost ? 1 : 0;
}

}  // namespace hybrid
