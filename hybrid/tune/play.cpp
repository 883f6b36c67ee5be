// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tune/play.h"

#include <algorithm>
#include <cmath>

#include "device/loop/stop_signal.h"
#include "hybrid/compare/compare_scenes.h"
#include "hybrid/session/equilibrium.h"
#include "hybrid/session/report.h"
#include "hybrid/tick/tick.h"

namespace hybrid {
namespace {

constexpr double kAfterMotion_s = 0.5;  // a session goes on after its path, so that tissue comes to rest

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

ForceCourse course_of(const World& world, const std::vector<TraceRow>& rows, std::uint32_t bits) {
  ForceCourse course;
  course.reserve(rows.size());
  for (const TraceRow& row : rows) {
    course.push_back({row.device_m, world.tool.stiffness_N_per_m * (row.proxy_m - row.device_m),
                      (row.contacts & bits) != 0});
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
  OtherPath(std::shared_ptr<const device::Path> path, const glm::dvec3& offset_m)
      : path_(std::move(path)), offset_m_(offset_m) {}
  [[nodiscard]] glm::dvec3 position(double t_s) const noexcept override {
    return path_->position(kOtherSpeed * t_s) + offset_m_;
  }
  [[nodiscard]] double duration_s() const noexcept override { return path_->duration_s() / kOtherSpeed; }
  [[nodiscard]] const std::vector<std::string>& notes() const noexcept override { return path_->notes(); }

 private:
  std::shared_ptr<const device::Path> path_;
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

Motion other_motion(const Motion& motion, double rate_hz, const glm::dvec3& offset_m) {
  return motion_along(std::make_shared<OtherPath>(motion.path, offset_m), rate_hz);
}

Played play_setting(const Scene& scene, const std::vector<std::string>& objects, const Motion& motion,
                    const Progress& progress) {
  BuiltScene built = build_scene(scene, progress);
  const SceneSize size = size_of(built);
  const std::uint32_t bits = contact_bits(*built.world, objects);
  const SessionResult result = run_session(scene, built, session_options(scene, motion, progress));
  device::stop_if_asked();
  Played played{.course = course_of(*built.world, result.rows, bits),
                .tick_us = {},
                .memory_bytes = size.memory_bytes,
                .soft_voxels = size.soft_voxels,
                .load_s = built.seconds,
                .faults = fault_texts(built.state->faults)};
  for (const TraceRow& row : result.rows) played.tick_us.push_back(row.tick_us);
  return played;
}

ForceCourse play_slowly(const Scene& scene, const std::vector<std::string>& objects, const Motion& motion,
                        int slower, const Progress& progress) {
  BuiltScene built = build_scene(scene, progress);
  const std::unique_ptr<WorldState> begin = copy_state(*built.world, *built.state);
  const SessionResult result = run_session(scene, built, session_options(scene, motion, progress));
  built.state.reset();
  device::stop_if_asked();
  ForceCourse course = course_of(*built.world, result.rows, contact_bits(*built.world, objects));
  const ForceCourse as_played = course;
  begin_session(scene, *built.world, *begin, result.start_m);
  (void)compare_with_slow_run(*built.world, *begin, as_played,
                              {.dt_s = result.dt_s,
                               .floor_N = jnd_floor_N(scene),
                               .most = 1,
                               .async_relaxation = true,
                               .arrival = Arrival::at_once,
                               .progress = progress,
                               .slower = slower,
                               .own_contact = true,
                               .felt = [&course](std::size_t tick, const glm::dvec3& force_N, bool soft) {
                                 course[tick].force_N = force_N;
                                 course[tick].soft = soft;
                               }});
  device::stop_if_asked();
  return course;
}

}  // namespace hybrid
