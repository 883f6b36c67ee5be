// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/session/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>

#include "device/loop/stop_signal.h"
#include "device/simulated/simulated.h"
#include "hybrid/base/flush_to_zero.h"
#include "hybrid/reference/live_reference.h"
#include "hybrid/session/pair_presses.h"
#include "hybrid/session/relaxation_thread.h"
#include "hybrid/snapshot/fill_snapshot.h"
#include "hybrid/tick/copy_state.h"
#include "hybrid/tick/proxy/rigid_proxy.h"
#include "hybrid/tick/tissue/async_relaxation.h"
#include "hybrid/tick/tissue/leave_tissue.h"
#include "hybrid/tick/tissue/work_budget.h"
#include "voxel/composite/grid.h"

namespace hybrid {
namespace {

constexpr double kAfterPath_s = 0.5;         // a session goes on for this time after its path has ended
constexpr double kWithHand_s = 60.0;         // a real device has no path that ends
constexpr std::uint64_t kMomentEvery = 20;   // ticks between two candidates for the kept snapshot
constexpr std::uint64_t kClearances = 1000;  // approximate number of samples of the clearance in a session

std::uint64_t hash_in(std::uint64_t hash, std::uint64_t bits) noexcept {  // FNV-1a, eight bytes at a time
  return (hash ^ bits) * 0x100000001B3ULL;
}
std::uint64_t hash_in(std::uint64_t hash, const glm::dvec3& v) noexcept {
  for (int d = 0; d < 3; ++d) hash = hash_in(hash, std::bit_cast<std::uint64_t>(v[d]));
  return hash;
}

std::uint64_t hash_in(std::uint64_t hash, const glm::dquat& q) noexcept {
  for (const double x : {q.w, q.x, q.y, q.z}) hash = hash_in(hash, std::bit_cast<std::uint64_t>(x));
  return hash;
}

// Score of the present tick. The session keeps a snapshot of the tick with the highest score; the picture of
// the session shows it. Each touched object adds its force on the hand (N), but at most 1. A tick that
// touches both a rigid and a soft object gets 10 more, so that the picture shows such a tick if there is one.
double moment_score(const World& world, const WorldState& state) {
  double score = 0.0;
  bool rigid = false, soft = false;
  for (std::size_t o = 0; o < state.feel.size(); ++o) {
    if (!state.feel[o].contact) continue;
    (o < world.rigid.size() ? rigid : soft) = true;
    score += std::min(1.0, state.feel[o].force_N);
  }
  return score + (rigid && soft ? 10.0 : 0.0);
}

// A path that is delayed by `later_s`.
class LaterPath final : public device::Path {
 public:
  LaterPath(std::shared_ptr<const device::Path> path, double later_s)
      : path_(std::move(path)), later_s_(later_s) {}
  [[nodiscard]] glm::dvec3 position(double t_s) const noexcept override {
    return path_->position(t_s - later_s_);
  }
  [[nodiscard]] double duration_s() const noexcept override { return path_->duration_s(); }
  [[nodiscard]] const std::vector<std::string>& notes() const noexcept override { return path_->notes(); }

 private:
  std::shared_ptr<const device::Path> path_;
  double later_s_;
};

std::shared_ptr<const device::Path> later(std::shared_ptr<const device::Path> path, double later_s) {
  if (later_s == 0.0) return path;
  return std::make_shared<LaterPath>(std::move(path), later_s);
}

class Run {
 public:
  // `course`: filled tick by tick. May be null.
  Run(const Scene& scene, const World& world, WorldState& state, const SessionOptions& options,
      ForceCourse* course)
      : scene_(scene),
        world_(world),
        state_(state),
        options_(options),
        course_(course),
        path_(later(options.path ? options.path : scene_path(scene),
                    static_cast<double>(options.start_ticks) / scene.rate_hz)),
        simulated_(options.real_device == nullptr ? scene_device(scene, path_) : nullptr),
        device_(options.real_device == nullptr ? *simulated_ : *options.real_device),
        realtime_(options.realtime || options.real_device != nullptr),
        follows_machine_(realtime_ && options.async_relaxation && !state.soft.empty()),
        dt_(1.0 / scene.rate_hz),
        work_share_(dt_),
        felt_(scene, world) {
    const double usual = options.real_device == nullptr ? path_->duration_s() + kAfterPath_s : kWithHand_s;
    const double seconds = options.seconds.value_or(usual);
    result_.device_name = device_.name();
    result_.path_notes = path_->notes();
    ticks_ = static_cast<std::uint64_t>(std::llround(seconds * scene.rate_hz));
    result_.planned_ticks = ticks_;
    result_.dt_s = dt_;
    if (const auto most = static_cast<std::uint64_t>(std::max(options.between_samples, 0)); most > 0)
      between_every_ = std::max<std::uint64_t>(1, (ticks_ + most - 1) / most);
    result_.between.keep_every = options.between_every_tick && !realtime_;
    if (result_.between.keep_every) between_every_ = 1;
    clearance_every_ = std::max<std::uint64_t>(1, ticks_ / kClearances);
    if (options.keep_recording) result_.recording.reserve(ticks_);
    result_.edits.reserve(options.edits.size());
    result_.object_contact_ticks.assign(world_.object_count(), 0);
    result_.object_max_force_N.assign(world_.object_count(), 0.0);
    if (!options.keep_rows) return;
    result_.rows.reserve(ticks_);
    result_.object_force_N.resize(world_.object_count());
    for (auto& column : result_.object_force_N) column.reserve(ticks_);
  }

  SessionResult run() {
    set_flush_to_zero();
    start_clocks();
    result_.start_m = device_.read().position_m;
    begin_session(scene_, world_, state_, result_.start_m);
    if (options_.async_relaxation)
      start_async_relaxation(state_, realtime_ ? Arrival::thread : Arrival::counted);
    std::optional<RelaxationThread> relaxation;
    if (options_.async_relaxation && options_.relaxation_thread && realtime_ && !state_.soft.empty())
      relaxation.emplace(world_, state_.async, options_.surfaces_hz);
    auto tick = [this](const device::ServoInput& input) { return answer(input); };
    device::ServoReport served;
    if (ticks_ > 0) {
      served = device::run_servo(
          device_, {.rate_hz = scene_.rate_hz, .realtime = realtime_, .deadline_s = world_.limits.deadline_s},
          tick);
    }
    if (options_.keep_picture && !result_.moment) {
      TickResult last;
      last.device_m = state_.device_m;
      last.proxy_m = state_.proxy_m;
      keep_moment(last, ticks_done_);
    }
    if (realtime_) {
      result_.realtime_note = served.priority;
      result_.deadline_misses = served.late_ticks;
      result_.late_us = late_us_.percentiles();
    }
    if (relaxation) result_.relaxation_s = relaxation->busy_s();
    relaxation.reset();
    result_.async_results = state_.async.results;
    if (between_every_ > 0 && ticks_done_ > 0) measure_between(ticks_done_ - 1);
    result_.end = served.end;
    result_.device_messages = std::move(served.messages);
    result_.ticks = ticks_done_;
    result_.state_hash = hash_state(hash_, state_);
    for (std::size_t o = 0; o < world_.soft.size(); ++o) result_.felt_materials.push_back(felt_.of(o));
    if (ticks_done_ > 0) result_.rms_force_N = std::sqrt(sum_force2_ / static_cast<double>(ticks_done_));
    return std::move(result_);
  }

 private:
  void start_clocks() {
    if (options_.start_ticks == 0) return;
    const double now_s = static_cast<double>(options_.start_ticks) * dt_;
    device_.delay(now_s);
    state_.tick = options_.start_ticks;
    state_.clock = device::Clock(now_s);
    state_.limit.elapsed_s = now_s;
    state_.limit.clamped = state_.limit.slewed = state_.truncated_ticks = options_.start_ticks;
  }

  // Runs on the driver's thread if the device has one. In real time nothing may delay the next tick: no
  // allocation (every column is reserved), no snapshot, no reference force.
  device::ServoAnswer answer(const device::ServoInput& input) {
    const ScopedFlushToZero flushed;
    const std::uint64_t tick = ticks_done_++;
    apply_edits(tick);
    if (follows_machine_) give_work_share(state_, work_share_.steps());
    const TickResult felt = haptic_tick(world_, state_, input.device, dt_);
    record_tick(felt, tick, input.device.fault);
    if (options_.black_box != nullptr) options_.black_box->add(black_box_row(input, felt, tick, state_));
    if (realtime_) {
      late_us_.add(input.late_s * 1e6);
      if (follows_machine_) follow_machine(felt.tick_us);
    } else {
      if (course_ != nullptr) keep_in_course(felt);
      if (options_.keep_picture && tick % kMomentEvery == 0) maybe_keep_snapshot(felt, tick);
      if (options_.on_frame && static_cast<double>(tick) * dt_ >= next_frame_s_) show_frame(felt, tick);
      if (options_.keep_clearance && tick % clearance_every_ == 0) measure_clearance(tick);
      if (between_every_ > 0 && tick % between_every_ == 0) measure_between(tick);
      if (options_.progress && tick % 64 == 0) report_progress(tick);
    }
    return {.force_N = felt.force_N, .go_on = ticks_done_ < ticks_};
  }

  void apply_edits(std::uint64_t tick) {
    for (; next_edit_ < options_.edits.size() && options_.edits[next_edit_].tick <= tick; ++next_edit_) {
      Edit edit = options_.edits[next_edit_];
      edit.tick = tick;
      if (apply_edit(world_, state_, edit)) result_.edits.push_back(edit);
    }
  }

  void follow_machine(double tick_us) {
    if (work_share_.steps() > 0) ++result_.ticks_with_less_work;
    result_.least_work_share = std::min(result_.least_work_share, WorkShare::share(work_share_.steps()));
    const bool pressed = std::any_of(state_.reactions.begin(), state_.reactions.end(),
                                     [](const voxel::Reaction& r) { return r.pressed > 0; });
    work_share_.observe(tick_us, pressed);
  }

  void report_progress(std::uint64_t tick) {
    const auto now = std::chrono::steady_clock::now();
    if (now - last_report_ <= std::chrono::milliseconds(500)) return;
    last_report_ = now;
    say(fmt::format("tick {} of {} ({:.0f} %)", tick, ticks_,
                    100.0 * static_cast<double>(tick) / static_cast<double>(ticks_)));
  }

  // The progress callback may throw StopAsked after a signal. The exception must not leave the servo loop,
  // which ends by itself and keeps the ticks so far.
  void say(const std::string& text) try { options_.progress(text); } catch (const device::StopAsked&) {
  }

  void record_tick(const TickResult& felt, std::uint64_t tick, device::DeviceFault fault) {
    hash_ = hash_tick(hash_, felt);
    if (options_.keep_recording)
      result_.recording.push_back({felt.device_m, hash_, fault, state_.async.arrived, work_share_.steps()});
    result_.tick_us.add(felt.tick_us);
    result_.servo_s += 1e-6 * felt.tick_us;
    result_.relaxation_s += 1e-6 * state_.async.other_thread_us;
    for (std::size_t s = 0; s < kStages; ++s) result_.stage_us[s].add(static_cast<double>(felt.stage_us[s]));
    const double force = glm::length(felt.force_N);
    result_.max_force_N = std::max(result_.max_force_N, force);
    sum_force2_ += force * force;
    if (felt.contacts != 0) ++result_.contact_ticks;
    for (std::size_t o = 0; o < state_.feel.size(); ++o) {
      if (state_.feel[o].contact) ++result_.object_contact_ticks[o];
      result_.object_max_force_N[o] = std::max(result_.object_max_force_N[o], state_.feel[o].force_N);
      if (options_.keep_rows) result_.object_force_N[o].push_back(state_.feel[o].force_N);
    }
    for (std::size_t o = 0; o < world_.soft.size(); ++o) {
      const ObjectFeel& feel = state_.feel[world_.rigid.size() + o];
      if (feel.contact) felt_.add(world_, state_, o, feel.force_N);
    }
    if (!options_.keep_rows) return;
    result_.rows.push_back({static_cast<double>(tick) * dt_, felt.device_m, felt.proxy_m, felt.force_N,
                            glm::length(felt.rigid_N), glm::length(felt.soft_N), felt.contacts, felt.tick_us,
                            felt.coupling_N});
  }

  void keep_in_course(const TickResult& felt) {
    const PassedTick passed = passed_tick(0, 0.0, world_, state_, felt);
    course_->push_back({passed.device_m, passed.coupling_N, passed.soft});
  }

  void measure_clearance(std::uint64_t tick) {
    if (state_.soft.empty()) return;
    ClearanceCourse& course = result_.clearance;
    const Clearance now = clearance(world_, state_);
    course.t_s.push_back(static_cast<double>(tick) * dt_);
    course.rigid_m.push_back(now.rigid_m);
    course.soft_m.push_back(now.soft_m);
    course.cell_m = std::numeric_limits<double>::infinity();
    for (const auto& object : state_.soft)
      course.cell_m = std::min(course.cell_m, object->lattice().min_spacing_m());
  }

  void measure_between(std::uint64_t tick) {
    if (state_.soft.empty()) return;
    const double t_s = static_cast<double>(tick) * dt_;
    if (result_.between.samples > 0 && result_.between.end_t_s == t_s) return;
    result_.between.add(forces_between(world_, state_), t_s);
  }

  void maybe_keep_snapshot(const TickResult& felt, std::uint64_t tick) {
    const double score = moment_score(world_, state_);
    if (score <= best_score_ * 1.02) return;
    best_score_ = score;
    keep_moment(felt, tick);
  }

  [[nodiscard]] Snapshot snapshot_of(const TickResult& felt, std::uint64_t tick) const {
    Snapshot snapshot = take_snapshot(world_, state_, felt, static_cast<double>(tick) * dt_);
    if (options_.picture_points) fill_asked(world_, state_, *options_.picture_points, false, snapshot);
    snapshot.presses = pair_presses(world_, state_);
    return snapshot;
  }

  void keep_moment(const TickResult& felt, std::uint64_t tick) { result_.moment = snapshot_of(felt, tick); }

  void show_frame(const TickResult& felt, std::uint64_t tick) {
    next_frame_s_ += 1.0 / kFrames_per_s;
    options_.on_frame(snapshot_of(felt, tick));
  }

  double next_frame_s_ = 0.0;
  const Scene& scene_;
  const World& world_;
  WorldState& state_;
  const SessionOptions& options_;
  ForceCourse* course_;
  std::shared_ptr<const device::Path> path_;
  std::unique_ptr<device::HapticDevice> simulated_;
  device::HapticDevice& device_;
  bool realtime_, follows_machine_;
  double dt_;
  WorkShare work_share_;
  FeltMaterials felt_;
  LatencyHistogram late_us_;
  std::chrono::steady_clock::time_point last_report_ = std::chrono::steady_clock::now();
  std::uint64_t clearance_every_ = 1, between_every_ = 0;  // between_every_ = 0: never
  std::uint64_t ticks_ = 0, ticks_done_ = 0, hash_ = kHashBegin;
  std::size_t next_edit_ = 0;
  double sum_force2_ = 0.0, best_score_ = 0.0;
  SessionResult result_;
};

}  // namespace

BlackBoxRow black_box_row(const device::ServoInput& input, const TickResult& felt, std::uint64_t tick,
                          const WorldState& state) noexcept {
  return {.tick = tick,
          .reported_m = input.device.position_m,
          .reported = input.device.fault,
          .faults = state.faults,
          .nonfinite = state.nonfinite,
          .late_us = static_cast<float>(input.late_s * 1e6),
          .felt = felt};
}

Percentiles percentiles(std::vector<double>& values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const auto at = [&values](double share) {
    const auto i = static_cast<std::size_t>(share * static_cast<double>(values.size()));
    return values[std::min(i, values.size() - 1)];
  };
  return {at(0.5), at(0.99), at(0.999), values.back()};
}

std::shared_ptr<const device::Path> scene_path(const Scene& scene) {
  try {
    return device::make_path(scene.path);
  } catch (const device::PathError& e) {
    throw SceneError(scene.file, scene.path_place, e.what());
  }
}

std::unique_ptr<device::HapticDevice> scene_device(const Scene& scene,
                                                   std::shared_ptr<const device::Path> path) {
  if (scene.device_model == device::DeviceModel::ideal)
    return device::make_simulated_device(scene.device_model, scene.hand, std::move(path));
  return device::make_simulated_device({.mechanism = device::mechanism(scene.device_model),
                                        .hand = scene.hand,
                                        .tremor = scene.tremor,
                                        .delay_ticks = scene.delay_ticks,
                                        .watchdog_s = scene.watchdog_s},
                                       std::move(path));
}

void begin_session(const Scene& scene, const World& world, WorldState& state, const glm::dvec3& device_m) {
  const auto refuse = [&](const char* inside) {
    throw SceneError(
        scene.file, scene.path_place,
        fmt::format("the path starts at ({:.4g}, {:.4g}, {:.4g}) m, inside {}; start it in free space",
                    device_m.x, device_m.y, device_m.z, inside));
  };
  if (!start_proxy(world, state, device_m)) refuse("something rigid");
  if (!leave_tissue(world, state)) refuse("tissue, with no way out for the tool");
}

void restore_tick_timing(const RecordedTick& tick, WorldState& state) noexcept {
  state.async.arrived = tick.arrived;
  give_work_share(state, tick.work_share);
}

namespace {

// A progress callback that does not throw StopAsked. A signal ends the comparison without it, and the session
// before the comparison must be kept.
Progress keep_going(const Progress& progress) {
  if (!progress) return {};
  return [&progress](const std::string& text) {
    try {
      progress(text);
    } catch (const device::StopAsked&) {
    }
  };
}

}  // namespace

SessionResult run_session(const Scene& scene, BuiltScene& built, const SessionOptions& options) {
  const char* not_measured = built.state->soft.empty()                            ? "nothing is soft"
                             : options.realtime || options.real_device != nullptr ? "real time"
                             : !options.measure_error                             ? "it was not asked for"
                             : !options.edits.empty()                             ? "values were edited"
                                                                                  : nullptr;
  if (not_measured != nullptr) {
    SessionResult result = Run(scene, *built.world, *built.state, options, nullptr).run();
    result.error.not_measured = not_measured;
    return result;
  }
  const std::unique_ptr<WorldState> begin = copy_state(*built.world, *built.state);
  ForceCourse course;
  SessionResult result = Run(scene, *built.world, *built.state, options, &course).run();
  begin_session(scene, *built.world, *begin, result.start_m);
  SlowRunOptions slow = slow_run_options(options.reference);
  slow.dt_s = result.dt_s;
  slow.floor_N = jnd_floor_N(scene);
  slow.async_relaxation = options.async_relaxation;
  slow.progress = keep_going(options.progress);
  result.error = compare_with_slow_run(*built.world, *begin, course, slow);
  return result;
}

std::uint64_t hash_tick(std::uint64_t before, const TickResult& tick) noexcept {
  return hash_in(hash_in(hash_in(before, tick.proxy_m), tick.force_N), tick.contacts);
}

std::uint64_t hash_state(std::uint64_t before, const WorldState& state) noexcept {
  std::uint64_t hash = hash_in(before, state.limit.last_N);
  for (const double x : {state.limit.elapsed_s, state.limit.handed.sum_J(), state.passive.given_J,
                         state.passive.worst_tick_J, state.passive.stride_m, state.passive.share})
    hash = hash_in(hash, std::bit_cast<std::uint64_t>(x));
  for (const RigidState& body : state.rigid) {
    hash = hash_in(hash_in(hash, body.pose.position_m), body.pose.rotation);
    hash = hash_in(hash_in(hash, body.free.centre_m), body.free.rotation);
    hash = hash_in(hash_in(hash, body.free.velocity_m_per_s), body.free.spin_rad_per_s);
  }
  for (const auto& object : state.soft) {
    for (const auto& axis : object->state().u) {
      for (const float u : axis) hash = hash_in(hash, std::bit_cast<std::uint32_t>(u));
    }
    if (object->patches_in_use() == nullptr) continue;
    object->patches_in_use()->for_values(
        [&hash](float u) { hash = hash_in(hash, std::bit_cast<std::uint32_t>(u)); });
  }
  return hash;
}

}  // namespace hybrid
