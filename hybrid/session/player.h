// SPDX-License-Identifier: GPL-3.0-or-later
// A session that a window steers. It takes requests and edits between ticks, hands over the figures of every
// tick, and keeps a recording.
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hybrid/reference/live_reference.h"
#include "hybrid/session/recording.h"
#include "hybrid/session/relaxation_thread.h"
#include "hybrid/session/session.h"
#include "hybrid/snapshot/tick_sample.h"

namespace hybrid {

// The window's requests to the session. They are handed over as a whole and may be skipped. So each event
// that happens once is a counter.
struct PlayRequest {
  bool dragging = false, paused = false;
  // If not 0: pauses and takes no edit, so that the window's thread may read the state. Each pause has its
  // own number, so that it is not confused with an earlier pause.
  std::uint32_t hold = 0;
  double speed = 1.0;              // simulated time over real time, 0 to 1; always 1 with a real device
  std::uint32_t restarts = 0;      // counts restarts of the hand's path
  std::uint32_t single_ticks = 0;  // counts single steps while paused
  // Points whose displacements the snapshots carry; may be null.
  std::shared_ptr<const AskedPoints> asked{};
  glm::dvec3 goal_m{0.0};  // position to which the mouse drags the tool; scene's frame
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

  struct Steering {
    bool dragged = false;
    glm::dvec3 goal_m{0.0};
    double start_s = 0.0;  // of the path
  };
  [[nodiscard]] const Steering& steering() const noexcept { return now_; }
  void steer_as(const Steering& steering) noexcept { now_ = steering; }

 private:
  std::shared_ptr<const device::Path> path_;
  Steering now_;
};

// The session at an earlier tick.
struct KeptState {
  std::uint64_t ticks = 0, hash = 0;
  std::size_t edits = 0, changes = 0;  // until then
  std::unique_ptr<WorldState> state;
  std::unique_ptr<device::HapticDevice> device;
  SteeredPath::Steering steering;
  glm::dvec3 goal_m{0.0};
  TickResult felt;
  std::size_t bytes = 0;  // memory that it takes
};

// A change that was made, and a copy of the state with which the session goes on. The state before it stays
// in the old scene. compare_at_rest() compares the forces.
struct ChangeMade {
  ChangeEffect effect;  // without forces
  std::unique_ptr<WorldState> after;
};

// The forces of two states at rest, each at its own position of the device. Any thread may call it while the
// states stay as they are. Empty if `stop` became true.
[[nodiscard]] std::optional<ComparedForces> compare_at_rest(const BuiltScene& before, const World& world,
                                                            const WorldState& after, double jnd_floor_N,
                                                            const std::atomic<bool>& stop);

class Player {
 public:
  // A recording keeps at most this much of a session (s): 86 MB at 1 kHz. Later ticks are not kept.
  static constexpr double kMostRecorded_s = 1800.0;
  // Edits that may wait for the next tick, and edits that a whole session may apply.
  static constexpr std::size_t kEditsWaiting = 256, kMostEdits = 100'000;
  // Ticks whose figures may wait for a frame: eight seconds at 1 kHz.
  static constexpr std::size_t kSamples = 8192;

  // Kept states, to which the session can go back: one for each second of the last minute, or as many as fit
  // into this memory.
  static constexpr double kKept_s = 60.0, kKeepEvery_s = 1.0;
  static constexpr std::size_t kMostKeptBytes = std::size_t{512} << 20;
  // Changes of the scene in a whole session.
  static constexpr std::size_t kMostChanges = 10'000;

  // Starts the proxy, or throws SceneError. `real_device`: null for the scene's simulated device. Keeps
  // references to all arguments.
  Player(const Scene& scene, BuiltScene& built, const DrawnScene& drawn, device::HapticDevice* real_device);

  // Call one of these two before the first tick. After go_live() a thread relaxes the tissue; the caller
  // keeps that thread. relax_at_once() relaxes it within the tick, so that frames are reproducible.
  [[nodiscard]] std::unique_ptr<RelaxationThread> go_live(double surfaces_hz);
  void relax_at_once();

  // The session goes on in another scene, which was made from `text` and built meanwhile (take_over.h). Call
  // it only while the session is held or has no servo loop, after the old scene's relaxation thread has
  // ended. Keeps references to the arguments. The old scene's arguments are no longer used, and hold the
  // state before the change. Throws std::runtime_error if that is not possible; the session then goes on as
  // it was. The caller sets `words` of the result.
  ChangeMade change_scene(const Scene& scene, BuiltScene& built, const DrawnScene& drawn,
                          const std::string& text);
  // ---- going back; for these calls the conditions of change_scene() hold ----
  // Keeps the present state, if a second of the session has passed since the last one was kept. Nothing is
  // kept with a real device. States of an earlier scene are dropped.
  void keep_state();
  [[nodiscard]] bool keeps_now() const noexcept;
  // The session goes on from kept state number `n`. Everything after that state is forgotten, in the
  // recording too.
  void go_back(std::size_t n);
  // Kept states, the oldest first. Only the thread that keeps them may call these four.
  [[nodiscard]] const std::deque<KeptState>& kept() const noexcept { return kept_; }
  // Is a state due? Never with a real device.
  [[nodiscard]] bool keeps_at(double t_s) const noexcept;
  [[nodiscard]] double time_of(const KeptState& kept) const noexcept {
    return dt_s_ * static_cast<double>(kept.ticks);
  }
  void snapshot_of(const KeptState& kept, Snapshot& out, const AskedPoints* asked = nullptr) const;

  // ---- the force at rest while the session goes on (live_reference.h) ----
  // Begins or ends the comparison with the force at rest, under the conditions of change_scene(). It begins
  // anew with each change of the scene, and when the session goes back. Returns the reason if it cannot
  // begin.
  std::string compare_with_rest(bool on);
  // The results; null if there is no comparison. Only the window's thread may call it.
  [[nodiscard]] ForcesAtRest* at_rest() noexcept { return reference_ ? &reference_->found() : nullptr; }

  // The thread that relaxes the tissue of the present scene, for a session that went live.
  [[nodiscard]] std::unique_ptr<RelaxationThread> relaxation_thread(double surfaces_hz);
  // Number of scenes before the present one.
  [[nodiscard]] std::uint32_t scene_number() const noexcept { return scenes_; }

  // ---- the servo thread; neither allocates, locks or throws ----
  // Takes edits, and does one tick if one is due. Returns true if there was a tick.
  bool advance(const PlayRequest& request, const device::ServoInput& input) noexcept;
  [[nodiscard]] const TickResult& felt() const noexcept { return felt_; }
  // Fills the snapshot of this moment, from within the servo loop. `asked`: as in PlayRequest.
  void snapshot(Snapshot& out, const AskedPoints* asked = nullptr) const;
  // Were edits taken, or the scene changed, since the last snapshot? False while held.
  [[nodiscard]] bool edited() const noexcept { return edited_ && held() == 0; }
  void shown() noexcept { edited_ = false; }

  // ---- without a servo loop: one period on the calling thread ----
  void step(const PlayRequest& request);

  // ---- the window's thread ----
  // Queues an edit. Returns false, and counts the refusal, if too many edits wait.
  bool edit(const Edit& edit) noexcept { return edits_.push(edit); }
  [[nodiscard]] std::uint64_t refused_edits() const noexcept { return edits_.refused(); }
  [[nodiscard]] TickSamples& samples() noexcept { return samples_; }
  // Ticks whose figures were dropped because no frame came for too long.
  [[nodiscard]] std::uint64_t unseen_ticks() const noexcept { return samples_.refused(); }
  [[nodiscard]] bool is_real() const noexcept { return simulated_ == nullptr; }
  // PlayRequest::hold as the servo thread saw it last. While it is not 0 that thread leaves the state alone.
  [[nodiscard]] std::uint32_t held() const noexcept { return held_.load(std::memory_order_acquire); }
  // The session so far. Call only while held, or after the session. Throws std::runtime_error if the session
  // is longer than kMostRecorded_s. `scene_text`: text of the scene with which the session began.
  [[nodiscard]] Recording recording(const std::string& scene_text) const;
  // The forces between objects now. Call only while held, or without a servo loop.
  [[nodiscard]] std::vector<PairPress> presses() const { return presses_of(*built_->state); }
  [[nodiscard]] std::vector<PairPress> presses_of(const WorldState& state) const;

  [[nodiscard]] double t_s() const noexcept { return static_cast<double>(ticks_) * dt_s_; }
  [[nodiscard]] std::uint64_t ticks() const noexcept { return ticks_; }
  [[nodiscard]] double rate_hz() const noexcept { return rate_hz_; }
  [[nodiscard]] double deadline_s() const noexcept { return built_->world->limits.deadline_s; }
  [[nodiscard]] device::HapticDevice& device() noexcept { return device_; }
  [[nodiscard]] const WorldState& state() const noexcept { return *built_->state; }

 private:
  void take_edits() noexcept;
  void begin_reference();
  [[nodiscard]] bool tick_is_due(const PlayRequest& request) noexcept;
  void steer(const PlayRequest& request) noexcept;
  void keep(device::DeviceFault fault) noexcept;
  void thin_out_kept();
  void fill_figures(Snapshot& out, const WorldState& state, const TickResult& felt,
                    std::uint64_t ticks) const;

  const Scene* scene_;
  BuiltScene* built_;
  const DrawnScene* drawn_;
  std::shared_ptr<SteeredPath> path_;
  std::unique_ptr<device::HapticDevice> simulated_;
  device::HapticDevice& device_;
  double rate_hz_, dt_s_;
  glm::dvec3 start_m_{0.0}, goal_m_{0.0};
  bool live_ = false, async_ = false, edited_ = false, whole_ = true;
  Arrival arrival_ = Arrival::counted;
  std::uint64_t ticks_ = 0, hash_ = kHashBegin;
  std::uint32_t restarts_ = 0, single_ticks_ = 0;
  double due_ = 0.0;  // ticks that are due, in slow motion: a fraction below 1
  TickResult felt_;
  std::vector<RecordedTick> recorded_;
  std::vector<Edit> applied_;
  std::vector<RecordedChange> changes_;
  std::deque<KeptState> kept_;
  std::uint32_t scenes_ = 0;
  SpscRing<Edit> edits_{kEditsWaiting};
  TickSamples samples_{kSamples};
  std::unique_ptr<LiveReference> reference_;
  std::atomic<std::uint32_t> held_{0};
};

}  // namespace hybrid
