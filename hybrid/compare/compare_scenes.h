// SPDX-License-Identifier: GPL-3.0-or-later
// Whole scenes played along one motion by the engine of `run`: differences of their forces and costs. The
// first scene is the reference. The device is ideal, so that the tool is at the same places in all scenes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hybrid/session/session.h"

namespace hybrid {

// Difference of a scene's force from the reference's. It covers the ticks of one kind in which at least one
// of the two scenes is felt.
struct ScenesDifference {
  std::uint64_t ticks = 0;
  double p50_jnd = 0.0, p99_jnd = 0.0, max_jnd = 0.0;
  double max_t_s = 0.0;  // time of the greatest difference
};

// Collects the differences of one kind of ticks.
class TickDifferences {
 public:
  void add(double jnd, double t_s);
  [[nodiscard]] ScenesDifference result() const;

 private:
  std::vector<double> jnd_;
  double max_jnd_ = -1.0, max_t_s_ = 0.0;
};

struct ComparedScene {
  std::string name;  // from the file's name; differs from the names of the other scenes
  std::vector<TraceRow> rows;
  double peak_N = 0.0;
  ScenesDifference all, moving, still;      // moving: the device is faster than kStill_m_per_s
  std::optional<double> direction_p99_deg;  // empty: the two forces are never both large enough
  std::optional<double> onset_s;            // first tick with more than kJndFloor_N; empty if there is none
  std::optional<double> onset_later_s;      // onset_s minus that of the reference; empty if either has none
  ForceError own_error;                     // against a slow run of the same scene along the same path
  Percentiles tick_us;                      // of all timed sessions together
  double load_s = 0.0;
  std::uint64_t memory_bytes = 0;  // of objects and occupancy map
  std::uint64_t soft_voxels = 0;
};

struct ScenesComparison {
  std::vector<ComparedScene> scenes;  // the first is the reference
  std::vector<std::string> notes;     // differences between the scenes that are not measured, in words
  double jnd_floor_N = 0.0;
};

// `own_errors`: each scene is also compared with its own slow run (SessionOptions::measure_error). Throws
// SceneError. Throws std::runtime_error: tools of another shape or size, or devices at another rate.
ScenesComparison compare_scenes(std::span<const Scene> scenes, bool own_errors, const Progress& progress);

// The size of a built scene before a session.
struct SceneSize {
  std::uint64_t memory_bytes = 0;  // of objects and occupancy map
  std::uint64_t soft_voxels = 0;   // of all soft objects
};
SceneSize size_of(const BuiltScene& built);

// The result for one scene in one sentence. `scene`: index of the scene, at least 1.
std::string verdict(const ScenesComparison& comparison, std::size_t scene);

}  // namespace hybrid
