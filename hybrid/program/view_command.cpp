// SPDX-License-Identifier: GPL-3.0-or-later
// The viewer: a window beside a session, each on its own thread. The session publishes snapshots and takes
// goals; neither waits for the other.
#include <fmt/format.h>

#include <atomic>
#include <cmath>
#include <cstdio>
#include <glm/geometric.hpp>
#include <thread>

#include "device/loop/servo_loop.h"
#include "device/simulated/simulated.h"
#include "hybrid/base/flush_to_zero.h"
#include "hybrid/base/triple_buffer.h"
#include "hybrid/program/commands.h"
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
constexpr double kScriptFrame_s = 1.0 / 30.0;  // session time that one frame of a scripted view stands for

// What the window asks of the session.
struct Wish {
  bool dragging = false, paused = false;
  std::uint32_t restarts = 0;
  glm::dvec3 goal_m{0.0};
};

// The target of the simulated hand: the scene's path, or where the mouse pulls. Read by the device within a
// tick.
class SteeredPath final : public device::Path {
 public:
  explicit SteeredPath(std::shared_ptr<const device::Path> path) : path_(std::move(path)) {}
  [[nodiscard]] glm::dvec3 position(double t_s) const noexcept override {
    return held_ ? goal_m_ : path_->position(std::fmod(t_s - start_s_, path_->duration_s() + 1.0));
  }
  [[nodiscard]] double duration_s() const noexcept override { return path_->duration_s(); }
  [[nodiscard]] const std::vector<std::string>& notes() const noexcept override { return path_->notes(); }

  void hold(const glm::dvec3& goal_m) {
    held_ = true;
    goal_m_ = goal_m;
  }
  void restart(double now_s) {
    held_ = false;
    start_s_ = now_s;
  }

 private:
  std::shared_ptr<const device::Path> path_;
  bool held_ = false;
  glm::dvec3 goal_m_{0.0};
  double start_s_ = 0.0;
};

// The session's side. Once the mouse has taken the tool it keeps it where it was let go, until a restart.
class Player {
 public:
  Player(const Scene& scene, BuiltScene& built, device::HapticDevice* real_device)
      : built_(built),
        path_(std::make_shared<SteeredPath>(scene_path(scene))),
        simulated_(real_device == nullptr ? scene_device(scene, path_) : nullptr),
        device_(real_device == nullptr ? *simulated_ : *real_device),
        rate_hz_(scene.rate_hz),
        dt_(1.0 / scene.rate_hz) {
    flush_denormals();
    goal_m_ = device_.read().position_m;
    begin_session(scene, *built.world, *built.state, goal_m_);
  }

  TickResult tick(const Wish& wish, const device::DeviceState& input) {
    if (wish.restarts != restarts_) {
      restarts_ = wish.restarts;
      path_->restart(t_s());
    }
    // The mouse pulls faster than a hand would: the goal follows it at no more than a brisk hand's speed.
    if (wish.dragging) {
      const glm::dvec3 way = wish.goal_m - goal_m_;
      const double length = glm::length(way), most = kHandSpeed_m_per_s * dt_;
      goal_m_ = length > most ? goal_m_ + way * (most / length) : wish.goal_m;
      path_->hold(goal_m_);
    }
    const TickResult felt = haptic_tick(*built_.world, *built_.state, input, dt_);
    if (!wish.dragging) goal_m_ = felt.device_m;
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
  // A tick of no real time, on this thread.
  TickResult step(const Wish& wish) {
    const TickResult felt = tick(wish, device_.read());
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
  // From now on tissue is relaxed by a thread, which the caller runs.
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

std::filesystem::path frame_file(const std::filesystem::path& folder, std::uint64_t n) {
  return folder / fmt::format("frame-{:05}.png", n);
}

// Every frame stands for a fixed stretch of session time, whatever the machine: pictures that can be made
// again.
void play_frames(const ViewCommand& command, Player& player, Window& window) {
  std::shared_ptr<const device::Path> drag;
  if (!command.drag.empty()) drag = device::make_path(device::CsvPath{.file = command.drag});
  Snapshot snapshot;
  for (std::uint64_t n = 0; n < *command.frames; ++n) {
    Wish wish;
    TickResult felt;
    for (double end = player.t_s() + kScriptFrame_s; player.t_s() < end;) {
      if (drag) {
        wish.dragging = true;
        wish.goal_m = drag->position(player.t_s());
      }
      felt = player.step(wish);
    }
    player.snapshot(felt, snapshot);
    if (!window.frame(snapshot)) return;
    if (!command.out.empty()) window.save_frame(frame_file(command.out, n));
  }
  if (!command.out.empty()) fmt::print("{} frames in {}\n", *command.frames, command.out.string());
}

// The window on this thread, the session on another. Says what happened to the device, if anything did.
device::ServoReport play_live(const DrawnScene& drawn, Player& player, Window& window, BlackBox& box) {
  HandOver<Snapshot> snapshots;
  HandOver<Wish> wishes;
  std::atomic<bool> stop{false}, ended{false};
  device::ServoReport report;
  const std::unique_ptr<RelaxationThread> relaxation = player.go_live();
  std::jthread session([&] {
    double next = 0.0;
    auto tick = [&](const device::ServoInput& input) -> device::ServoAnswer {
      const FlushedDenormals flushed;
      const bool go_on = !stop.load(std::memory_order_relaxed);
      const Wish& wish = wishes.take();
      if (wish.paused || !go_on) return {.go_on = go_on, .skip = true};
      const TickResult felt = player.tick(wish, input.device);
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
  Wish wish;
  Snapshot shown;
  do {
    const WindowInput input = window.take_input();
    wish.dragging = input.dragged_goal_m.has_value();
    if (input.dragged_goal_m) wish.goal_m = *input.dragged_goal_m;
    wish.paused = input.paused;
    if (input.restart) ++wish.restarts;
    wishes.back() = wish;
    wishes.publish();
    show_live(drawn, snapshots.take(), relaxation->surfaces(), shown);
  } while (window.frame(shown) && !ended);
  stop = true;
  session.join();
  return report;
}

}  // namespace

int view(const ViewCommand& command) {
  Scene scene = load_scene(command.scene);
  if (!command.device.empty()) use_device(scene, command.device);
  // Frames are pictures that can be made again, and so need a hand that can.
  if (command.frames && scene.real_device) {
    throw SceneError(scene.file, scene.real_device->place,
                     "--frames needs a simulated device; add --device premium-1.5");
  }
  if (!command.out.empty()) std::filesystem::create_directories(command.out);
  const auto real = open_real_device(scene);
  BuiltScene built = build_scene(scene, progress_on_terminal());
  end_progress();
  print_notes(built);
  const DrawnScene drawn =
      drawn_scene(scene, built, scene.title.empty() ? command.scene.stem().string() : scene.title);
  Window window(drawn);
  if (real) {
    std::fprintf(stderr, "note: %s\n", place_real_device(scene, *built.world, *real).c_str());
    await_free_tool(scene, *built.world, *built.state, *real, progress_on_terminal());
    end_progress();
  }
  Player player(scene, built, real.get());
  if (command.frames) {
    start_async_relaxation(*built.state, Arrival::counted);
    play_frames(command, player, window);
    return 0;
  }
  const auto kept = keep_box({}, command.scene, true, scene.rate_hz);
  const device::ServoReport report = play_live(drawn, player, window, kept->box());
  print_fault(*kept);
  for (const std::string& message : report.messages) std::fprintf(stderr, "device: %s\n", message.c_str());
  return report.end == device::ServoEnd::lost ? 1 : 0;
}

}  // namespace hybrid
