// SPDX-License-Identifier: GPL-3.0-or-later
// A session that a window steers: it takes requests and edits between ticks, hands every tick's figures over,
// and keeps a recording of itself.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "hybrid/session/recording.h"
#include "hybrid/session/relaxation_thread.h"
#include "hybrid/session/session.h"
#include "hybrid/snapshot/tick_sample.h"

namespace hybrid {

// What a window asks of the session. It is handed over as a whole, so everything that happens once is a
// counter.
struct PlayRequest {
  bool dragging = false, paused = false;
  bool hold = false;           // as paused, and no edit is taken: the state may be read by the other thread
  double speed = 1.0;          // simulated time over real time, 0 to 1; a real device has 1
  std::uint32_t restarts = 0;  // of the hand's path
  std::uint32_t single_ticks = 0;  // while paused
  glm::dvec3 goal_m{0.0};          // of the drag
};

// Target of the simulated hand: the scene's path, or the goal of the mouse. The device reads it within a
// tick.
class SteeredPath final : public device::Path {
 public:
  explicit SteeredPath(std::shared_ptr<const device::Path> path) : path_(std::move(path)) {}
  [[nodiscard]] glm::dvec3 position(double t_s) const noexcept override;
  [[nodiscard]] double duration_s() const noexcept override { return path_->duration_s(); }
  [[nodiscard]] const std::vector<std::string>& notes() const noexcept override { return path_->notes(); }
  void drag_to(const glm::dvec3& goal_m) noexcept;
  void restart(double now_s) noexcept;

 private:
  std::shared_ptr<const device::Path> path_;
  bool dragged_ = false;
  glm::dvec3 goal_m_{0.0};
  double start_s_ = 0.0;
};

class Player {
 public:
  // Longest session that is kept as a recording (s): 86 MB at 1 kHz. What follows is not kept.
  static constexpr double kMostRecorded_s = 1800.0;
  // Edits that may wait for the next tick, and edits of a whole session.
  static constexpr std::size_t kEditsWaiting = 256, kMostEdits = 100'000;
  static constexpr std::size_t kSamples = 8192;  // eight seconds without a frame, at 1 kHz

  // Starts the proxy or throws SceneError. `real_device`: null for the scene's simulated one. Keeps
  // references.
  Player(const Scene& scene, BuiltScene& built, const DrawnScene& drawn, device::HapticDevice* real_device);

  // Before the first tick. go_live(): from now on a thread relaxes the tissue; the caller keeps that thread.
  // relax_at_once(): for frames that are reproducible.
  [[nodiscard]] std::unique_ptr<RelaxationThread> go_live(double surfaces_hz);
  void relax_at_once();

  // ---- the servo thread; neither allocates, locks or throws ----
  // Takes edits, and does one tick if one is due. `felt` is the last tick's result. True if there was a tick.
  bool advance(const PlayRequest& request, const device::ServoInput& input) noexcept;
  [[nodiscard]] const TickResult& felt() const noexcept { return felt_; }
  // The snapshot of now, from within the servo loop.
  void snapshot(Snapshot& out) const;
  // Edits were taken since the last snapshot.
  [[nodiscard]] bool edited() const noexcept { return edited_; }
  void shown() noexcept { edited_ = false; }

  // ---- the same without a servo loop: one period on this thread ----
  void step(const PlayRequest& request);

  // ---- the window's thread ----
  // Queues an edit; false, and counted, if too many wait.
  bool edit(const Edit& edit) noexcept { return edits_.push(edit); }
  [[nodiscard]] std::uint64_t refused_edits() const noexcept { return edits_.refused(); }
  [[nodiscard]] TickSamples& samples() noexcept { return samples_; }
  // Ticks whose figures found no room, because no frame came for too long.
  [[nodiscard]] std::uint64_t unseen_ticks() const noexcept { return samples_.refused(); }
  [[nodiscard]] bool is_real() const noexcept { return simulated_ == nullptr; }
  // The servo thread has seen PlayRequest::hold and leaves the state alone.
  [[nodiscard]] bool held() const noexcept { return held_.load(std::memory_order_acquire); }
  // The session so far. Only while held, or after the session. Throws std::runtime_error if the session is
  // longer than what is kept.
  [[nodiscard]] Recording recording(const std::string& scene_text) const;

  [[nodiscard]] double t_s() const noexcept { return static_cast<double>(ticks_) * dt_s_; }
  [[nodiscard]] std::uint64_t ticks() const noexcept { return ticks_; }
  [[nodiscard]] double rate_hz() const noexcept { return rate_hz_; }
  [[nodiscard]] double deadline_s() const noexcept { return built_.world->limits.deadline_s; }
  [[nodiscard]] device::HapticDevice& device() noexcept { return device_; }
  [[nodiscard]] const WorldState& state() const noexcept { return *built_.state; }

 private:
  void take_edits() noexcept;
  [[nodiscard]] bool tick_is_due(const PlayRequest& request) noexcept;
  void steer(const PlayRequest& request) noexcept;
  void keep(device::DeviceFault fault) noexcept;

  const Scene& scene_;
  BuiltScene& built_;
  const DrawnScene& drawn_;
  std::shared_ptr<SteeredPath> path_;
  std::unique_ptr<device::HapticDevice> simulated_;
  device::HapticDevice& device_;
  double rate_hz_, dt_s_;
  glm::dvec3 start_m_{0.0}, goal_m_{0.0};
  bool live_ = false, async_ = false, edited_ = false, whole_ = true;
  std::uint64_t ticks_ = 0, hash_ = kHashBegin;
  std::uint32_t restarts_ = 0, single_ticks_ = 0;
  double due_ = 0.0;  // ticks that are due, in slow motion
  TickResult felt_;
  std::vector<RecordedTick> recorded_;
  std::vector<Edit> applied_;
  SpscRing<Edit> edits_{kEditsWaiting};
  TickSamples samples_{kSamples};
  std::atomic<bool> held_{false};
};

}  // namespace hybrid
