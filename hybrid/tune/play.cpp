// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tune/play.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>

#include "device/loop/stop_signal.h"
#include "hybrid/base/flush_to_zero.h"
#include "hybrid/compare/compare_scenes.h"
#include "hybrid/feel/just_noticeable.h"
#include "hybrid/session/report.h"
#include "hybrid/tick/tick.h"
#include "hybrid/tick/tissue/async_relaxation.h"

namespace hybrid {
namespace {

constexpr double kAfterMotion_s = 0.5;  // a session goes on after its path, so that tissue comes to rest
// A reference at rest may be in contact for up to this time before and after a contact of the session.
constexpr double kAround_s = 0.02;
constexpr std::size_t kReportEvery = 64;  // ticks
// A pose is held for rounds of ticks. In each round the whole object is relaxed once. The number of rounds
// begins with kFewestRounds. It is doubled until a doubling changes the force by less than kAtRest_jnd, or
// until it reaches kMostRounds.
constexpr int kTicksOfRound = kTicksBetweenAtOnce, kFewestRounds = 2, kMostRounds = 64;
constexpr double kAtRest_jnd = 0.1;

// The contact bits of the named objects. In a given world some of them are soft and others rigid.
std::uint32_t contact_bits(const World& world, const std::vector<std::string>& objects) {
  std::uint32_t bits = 0;
  for (std::size_t o = 0; o < world.object_count(); ++o) {
    const std::size_t rigid = world.rigid.size();
    const std::string& name = o < rigid ? world.rigid[o].name : world.soft[o - rigid].name;
    if (std::ranges::find(objects, name) != objects.end()) bits |= 1U << std::min(o, kLastContactBit);
  }
  return bits;
}

ForceCourse course_of(const std::vector<TraceRow>& rows, std::uint32_t bits) {
  ForceCourse course;
  course.reserve(rows.size());
  for (const TraceRow& row : rows) {
    course.push_back({row.device_m, row.coupling_N, (row.contacts & bits) != 0});
  }
  return course;
}

SessionOptions session_options(const Scene& scene, const Motion& motion, const Progress& progress) {
  SessionOptions options;
  options.seconds = static_cast<double>(motion.ticks) / scene.rate_hz;
  options.keep_recording = false;
  options.progress = progress;
  options.async_relaxation = true;
  options.path = motion.path;
  return options;
}

class OtherPath final : public device::Path {
 public:
  OtherPath(std::shared_ptr<const device::Path> path, double speed, const glm::dvec3& offset_m)
      : path_(std::move(path)), speed_(speed), offset_m_(offset_m) {}
  [[nodiscard]] glm::dvec3 position(double t_s) const noexcept override {
    return path_->position(speed_ * t_s) + offset_m_;
  }
  [[nodiscard]] double duration_s() const noexcept override { return path_->duration_s() / speed_; }
  [[nodiscard]] const std::vector<std::string>& notes() const noexcept override { return path_->notes(); }

 private:
  std::shared_ptr<const device::Path> path_;
  double speed_;
  glm::dvec3 offset_m_;
};

Motion motion_along(std::shared_ptr<const device::Path> path, double rate_hz) {
  const auto ticks =
      static_cast<std::uint64_t>(std::llround((path->duration_s() + kAfterMotion_s) * rate_hz));
  return {std::move(path), ticks};
}

}  // namespace

Motion scene_motion(const Scene& scene) {
  return motion_along(scene_path(scene), scene.rate_hz);
}

Motion other_motion(const Motion& motion, double rate_hz, double speed, const glm::dvec3& offset_m) {
  return motion_along(std::make_shared<OtherPath>(motion.path, speed, offset_m), rate_hz);
}

Played play_setting(const Scene& scene, const std::vector<std::string>& objects, const Motion& motion,
                    const Progress& progress) {
  BuiltScene built = build_scene(scene, progress);
  const SceneSize size = size_of(built);
  const std::uint32_t bits = contact_bits(*built.world, objects);
  const SessionResult result = run_session(scene, built, session_options(scene, motion, progress));
  device::stop_if_asked();
  Played played{.course = course_of(result.rows, bits),
                .tick_us = {},
                .memory_bytes = size.memory_bytes,
                .soft_voxels = size.soft_voxels,
                .load_s = built.seconds,
                .on_patches = std::ranges::any_of(built.state->soft,
                                                  [](const auto& object) { return object->uses_patches(); }),
                .faults = fault_texts(built.state->faults)};
  for (const TraceRow& row : result.rows) played.tick_us.push_back(row.tick_us);
  return played;
}

Poses poses_along(const ForceCourse& course, double dt_s, bool bodies_move, int most) {
  const auto around = static_cast<std::size_t>(std::lround(kAround_s / dt_s));
  const std::vector<bool> none(course.size(), false);
  Poses poses{none, none, none};
  for (std::size_t t = 0; t < course.size(); ++t) {
    if (!course[t].soft) continue;
    for (std::size_t n = t - std::min(t, around); n < std::min(t + around + 1, course.size()); ++n)
      poses.near[n] = true;
  }
  std::size_t moving = 0;
  bool moved = true;
  for (std::size_t t = 0; t < course.size(); ++t) {
    const bool moves = bodies_move || t == 0 ||
                       glm::distance(course[t].device_m, course[t - 1].device_m) > kStill_m_per_s * dt_s;
    poses.held[t] = poses.near[t] && (moves || moved);
    poses.stops[t] = poses.held[t] && !moves;
    moving += poses.held[t] && moves ? 1 : 0;
    moved = moves;
  }
  const auto limit = static_cast<std::size_t>(most);
  return every_nth(poses, std::max<std::size_t>(1, (moving + limit - 1) / limit));
}

Poses every_nth(const Poses& poses, std::size_t n) {
  Poses fewer = poses;
  std::size_t moving = 0;
  for (std::size_t t = 0; t < fewer.held.size(); ++t) {
    if (fewer.held[t] && !fewer.stops[t]) fewer.held[t] = moving++ % n == 0;
  }
  return fewer;
}

namespace {

// Brings tissue to rest from pose to pose.
class RestPlayer {
 public:
  RestPlayer(const Scene& scene, const std::vector<std::string>& objects, const Motion& motion,
             const Progress& progress)
      : built_(build_scene(scene, progress)),
        motion_(motion),
        progress_(progress),
        dt_s_(1.0 / scene.rate_hz),
        bits_(contact_bits(*built_.world, objects)),
        floor_N_(jnd_floor_N(scene)) {
    device_m_ = motion.path->position(0.0);
    begin_session(scene, *built_.world, *built_.state, device_m_);
    start_async_relaxation(*built_.state, Arrival::at_once);
  }

  RestCourse play(const Poses& poses, int slower) {
    const ScopedFlushToZero flushed;
    RestCourse played;
    played.poses = poses;
    bool rests = false;
    for (std::size_t t = 0; t < poses.held.size(); ++t) {
      if (t % kReportEvery == 0) say(t, poses.held.size());
      const glm::dvec3 to_m = motion_.path->position(static_cast<double>(t) * dt_s_);
      const bool still = t > 0 && glm::distance(to_m, device_m_) <= kStill_m_per_s * dt_s_;
      rests = rests && still;
      move(to_m, touches() && !rests ? slower : 1);
      if (poses.held[t]) {
        hold();
        rests = poses.stops[t];
      }
      const bool away = !poses.near[t] && !touches(), at_rest = poses.held[t] || rests;
      played.course.push_back({device_m_, force_N(), touches(), at_rest || away});
      played.halfway.push_back(played.course.back());
      if (at_rest) played.halfway.back().force_N = halfway_N_;
    }
    return played;
  }

 private:
  [[nodiscard]] bool touches() const { return (felt_.contacts & bits_) != 0; }
  [[nodiscard]] glm::dvec3 force_N() const { return felt_.coupling_N; }
  void say(std::size_t tick, std::size_t ticks) const {
    device::stop_if_asked();
    if (progress_)
      progress_(fmt::format("{:.0f} % of the path",
                            100.0 * static_cast<double>(tick) / static_cast<double>(ticks)));
  }

  void move(const glm::dvec3& to_m, int parts) {
    for (int n = 1; n <= parts; ++n) {
      const glm::dvec3 at_m = n < parts ? glm::mix(device_m_, to_m, n / static_cast<double>(parts)) : to_m;
      felt_ = haptic_tick(*built_.world, *built_.state, {.position_m = at_m}, dt_s_ / parts);
    }
    device_m_ = to_m;
  }

  // The clock stands still, so that bodies do not move.
  void rounds(int count) {
    for (int n = 0; n < count * kTicksOfRound; ++n)
      felt_ = haptic_tick(*built_.world, *built_.state, {.position_m = device_m_}, 0.0);
    device::stop_if_asked();
  }

  void hold() {
    rounds(kFewestRounds);
    for (int played = kFewestRounds;; played *= 2) {
      halfway_N_ = force_N();
      rounds(played);
      if (2 * played >= kMostRounds || jnd_of(halfway_N_, force_N(), floor_N_) < kAtRest_jnd) return;
    }
  }

  BuiltScene built_;
  const Motion& motion_;
  const Progress& progress_;
  double dt_s_;
  std::uint32_t bits_;
  double floor_N_;
  glm::dvec3 device_m_{0.0};
  TickResult felt_{};
  glm::dvec3 halfway_N_{0.0};  // force in the last pose after half of its hold
};

}  // namespace

RestCourse play_to_rest(const Scene& scene, const std::vector<std::string>& objects, const Motion& motion,
                        const Poses& poses, int slower, const Progress& progress) {
  return RestPlayer(scene, objects, motion, progress).play(poses, slower);
}

}  // namespace hybrid
