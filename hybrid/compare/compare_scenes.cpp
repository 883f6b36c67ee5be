// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/compare/compare_scenes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <stdexcept>

#include "hybrid/compare/compare.h"
#include "hybrid/feel/just_noticeable.h"
#include "hybrid/session/report.h"
#include "hybrid/tick/copy_state.h"

namespace hybrid {
namespace {

constexpr int kTimedRounds = 2;        // sessions of each scene; the second round has the reverse order
constexpr int kPathSamples = 1000;     // places at which two paths are compared
constexpr double kSamePath_m = 1e-9;   // allows for rounding of lengths in other units
constexpr double kSamePeriod = 1e-12;  // relative; allows for rounding of a rate

std::string tool_in_words(const Tool& tool) {
  return fmt::format("a {} of radius {:.4g} mm", tool.shape == Tool::Shape::ball ? "ball" : "punch",
                     1e3 * tool.radius_m);
}

// Names that differ from one another. A name is the stem of the file. If two stems are equal, it is the whole
// file name. If those are equal too, it is the stem with a number.
std::vector<std::string> scene_names(std::span<const Scene> scenes) {
  std::vector<std::string> names;
  for (std::size_t s = 0; s < scenes.size(); ++s) {
    const auto alike = [&](const auto& part) {
      return std::ranges::count_if(scenes, [&](const Scene& o) { return part(o) == part(scenes[s]); }) > 1;
    };
    const auto stem = [](const Scene& scene) { return scene.file.stem().string(); };
    const auto whole = [](const Scene& scene) { return scene.file.string(); };
    if (!alike(stem)) {
      names.push_back(stem(scenes[s]));
    } else if (!alike(whole)) {
      names.push_back(whole(scenes[s]));
    } else {
      names.push_back(fmt::format("{} ({})", stem(scenes[s]), s + 1));
    }
  }
  return names;
}

void require_comparable(const Scene& first, const Scene& other) {
  if (other.tool.shape != first.tool.shape || other.tool.radius_m != first.tool.radius_m) {
    throw std::runtime_error(fmt::format(
        "{}: its tool is {}, that of {} is {}: their forces would be those of different contacts; give both "
        "the same shape and radius in [tool]",
        other.file.string(), tool_in_words(other.tool), first.file.string(), tool_in_words(first.tool)));
  }
  if (std::fabs(other.rate_hz - first.rate_hz) > kSamePeriod * first.rate_hz) {
    throw std::runtime_error(fmt::format(
        "{}: its device runs at {:.6g} Hz, that of {} at {:.6g} Hz: their ticks are at different times; give "
        "both the same rate in [device]",
        other.file.string(), other.rate_hz, first.file.string(), first.rate_hz));
  }
}

bool same_path(const device::Path& a, const device::Path& b) {
  const double end_s = std::max(a.duration_s(), b.duration_s());
  for (int n = 0; n <= kPathSamples; ++n) {
    const double t_s = end_s * n / kPathSamples;
    if (glm::distance(a.position(t_s), b.position(t_s)) > kSamePath_m) return false;
  }
  return true;
}

void note_differences(const Scene& first, const Scene& other, const std::string& first_name,
                      const std::string& name, const device::Path& path, std::vector<std::string>& notes) {
  if (!same_path(path, *scene_path(other)))
    notes.push_back(fmt::format("{} has another path of its own: that of {} is played", name, first_name));
  if (other.tool.stiffness_N_per_m != first.tool.stiffness_N_per_m) {
    notes.push_back(
        fmt::format("the coupling of {} has {:.6g} N/m, that of {} {:.6g} N/m: part of the difference", name,
                    other.tool.stiffness_N_per_m, first_name, first.tool.stiffness_N_per_m));
  }
}

void measure_scene(ComparedScene& scene, const ComparedScene& reference, double floor_N, double dt_s) {
  TickDifferences all, moving, still;
  std::vector<double> angle_deg;
  const std::size_t count = std::min(scene.rows.size(), reference.rows.size());
  for (std::size_t i = 0; i < count; ++i) {
    const glm::dvec3 &f = scene.rows[i].force_N, &r = reference.rows[i].force_N;
    const double size_N = glm::length(f), reference_N = glm::length(r), t_s = scene.rows[i].t_s;
    scene.peak_N = std::max(scene.peak_N, size_N);
    if (size_N > kJndFloor_N && !scene.onset_s) scene.onset_s = t_s;
    if (size_N == 0.0 && reference_N == 0.0) continue;
    const bool holds =
        i > 0 && glm::distance(scene.rows[i].device_m, scene.rows[i - 1].device_m) <= kStill_m_per_s * dt_s;
    const double jnd = jnd_of(f, r, floor_N);
    all.add(jnd, t_s);
    (holds ? still : moving).add(jnd, t_s);
    if (size_N > kLeastDirected_N && reference_N > kLeastDirected_N)
      angle_deg.push_back(angle_between_deg(f, r));
  }
  scene.all = all.result();
  scene.moving = moving.result();
  scene.still = still.result();
  if (!angle_deg.empty()) scene.direction_p99_deg = percentiles(angle_deg).p99;
  if (scene.onset_s && reference.onset_s) scene.onset_later_s = *scene.onset_s - *reference.onset_s;
}

// run_session() names the scene's own path when it refuses. The error here also names the path that is
// played.
SessionResult play(const Scene& scene, BuiltScene& built, const SessionOptions& options,
                   const std::string& first_name) {
  try {
    return run_session(scene, built, options);
  } catch (const SceneError& error) {
    throw std::runtime_error(
        fmt::format("{}\n(played is the path of {}, the first scene)", error.what(), first_name));
  }
}

}  // namespace

ScenesComparison compare_scenes(std::span<const Scene> scenes, bool own_errors, const Progress& progress) {
  if (scenes.empty()) throw std::invalid_argument("compare_scenes: no scene");
  for (const Scene& scene : scenes) require_comparable(scenes.front(), scene);
  const std::vector<std::string> names = scene_names(scenes);
  const std::shared_ptr<const device::Path> path = scene_path(scenes.front());
  ScenesComparison comparison;
  std::vector<Scene> ideal;
  std::vector<BuiltScene> built;
  for (std::size_t s = 0; s < scenes.size(); ++s) {
    note_differences(scenes.front(), scenes[s], names.front(), names[s], *path, comparison.notes);
    ideal.push_back(on_ideal_device(scenes[s]));
    built.push_back(build_scene(ideal.back(), progress));
    comparison.scenes.emplace_back();
    comparison.scenes.back().name = names[s];
    const SceneSize size = size_of(built.back());
    comparison.scenes.back().load_s = built.back().seconds;
    comparison.scenes.back().memory_bytes = size.memory_bytes;
    comparison.scenes.back().soft_voxels = size.soft_voxels;
  }
  comparison.jnd_floor_N = jnd_floor_N(ideal.front());

  std::vector<LatencyHistogram> tick_us(scenes.size());
  double dt_s = 0.0;
  for (int round = 0; round < kTimedRounds; ++round) {
    const bool last = round + 1 == kTimedRounds;
    for (std::size_t n = 0; n < scenes.size(); ++n) {
      const std::size_t s = round % 2 == 0 ? n : scenes.size() - 1 - n;
      std::unique_ptr<WorldState> begin = last ? nullptr : copy_state(*built[s].world, *built[s].state);
      SessionOptions options;
      options.keep_rows = last;
      options.keep_recording = false;
      options.measure_error = last && own_errors;
      options.progress = progress;
      options.async_relaxation = true;
      options.path = path;
      SessionResult result = play(ideal[s], built[s], options, names.front());
      tick_us[s].add(result.tick_us);
      dt_s = result.dt_s;
      if (!last) {
        built[s].state = std::move(begin);
        continue;
      }
      comparison.scenes[s].rows = std::move(result.rows);
      comparison.scenes[s].own_error = result.error;
      for (const std::string& fault : fault_texts(built[s].state->faults))
        comparison.notes.push_back(fmt::format("{}: {}", names[s], fault));
      built[s] = {};  // frees its memory for the other scenes
    }
  }
  for (std::size_t s = 0; s < scenes.size(); ++s) {
    ComparedScene& scene = comparison.scenes[s];
    scene.tick_us = tick_us[s].percentiles();
    measure_scene(scene, comparison.scenes.front(), comparison.jnd_floor_N, dt_s);
  }
  return comparison;
}

void TickDifferences::add(double jnd, double t_s) {
  jnd_.push_back(jnd);
  if (jnd <= max_jnd_) return;
  max_jnd_ = jnd;
  max_t_s_ = t_s;
}

ScenesDifference TickDifferences::result() const {
  std::vector<double> sorted = jnd_;
  const Percentiles p = percentiles(sorted);
  return {.ticks = jnd_.size(), .p50_jnd = p.p50, .p99_jnd = p.p99, .max_jnd = p.max, .max_t_s = max_t_s_};
}

SceneSize size_of(const BuiltScene& built) {
  SceneSize size{.memory_bytes = built.state->map.memory_bytes()};
  for (const RigidObject& object : built.world->rigid) size.memory_bytes += object.memory_bytes();
  for (const auto& object : built.state->soft) {
    size.memory_bytes += object->memory_bytes();
    size.soft_voxels += object->lattice().voxel_count();
  }
  return size;
}

std::string verdict(const ScenesComparison& comparison, std::size_t index) {
  const ComparedScene &reference = comparison.scenes.front(), &scene = comparison.scenes[index];
  if (scene.all.ticks == 0) {
    return fmt::format("Nothing is felt in {} or in {} along this path: choose another path.", scene.name,
                       reference.name);
  }
  const ScenesDifference& most = scene.moving.max_jnd >= scene.still.max_jnd ? scene.moving : scene.still;
  std::string text =
      scene.all.max_jnd <= 1.0
          ? fmt::format("{} and {} cannot be told apart (at most {:.2g} JND, reference {})", scene.name,
                        reference.name, scene.all.max_jnd, reference.name)
          : fmt::format("{} can be told from {}: up to {:.1f} JND at {:.3f} s, {} (p99 {:.1f}, reference {})",
                        scene.name, reference.name, most.max_jnd, most.max_t_s,
                        &most == &scene.moving ? "while the tool moves" : "while it is still",
                        scene.all.p99_jnd, reference.name);
  if (reference.tick_us.p999 > 0.0) {
    text += fmt::format("; its tick p99.9 is {:.2f} of that of {}",
                        scene.tick_us.p999 / reference.tick_us.p999, reference.name);
  }
  const ForceError &own = scene.own_error, &of_reference = reference.own_error;
  if (std::max(own.all.max_jnd, of_reference.all.max_jnd) > 1.0) {
    text += fmt::format("; against themselves played slowly, {} is off by up to {:.1f} JND, {} by {:.1f}",
                        reference.name, of_reference.all.max_jnd, scene.name, own.all.max_jnd);
  }
  return text + ".";
}

}  // namespace hybrid
