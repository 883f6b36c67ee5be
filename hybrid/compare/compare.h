// SPDX-License-Identifier: GPL-3.0-or-later
// One object of a scene felt in several ways along the same motion: as mesh and proxy, as voxels where it has
// any, a rigid one by the surface nearest to the device (no proxy: thesis, Fig 18), a soft one also by the
// thesis's own algorithm (voxel/baseline/thesis_chainmail.h), and in closed form where one applies (ball, box
// or block under a ball; flat punch on a block).
#pragma once

#include <string>
#include <vector>

#include "hybrid/session/session.h"

namespace hybrid {

inline constexpr const char* kThesisModel = "classic";  // the name of the thesis's algorithm

struct ModelResult {
  std::string name;  // "mesh and proxy", "nearest-surface", "voxels", "classic", "hertz", "flat punch",
                     // "rigid closed form"
  std::vector<TraceRow> rows;
  std::vector<double>
      depth_m;  // of the device in the undeformed object, [row]; negative outside; empty where unknown
  Percentiles tick_us;  // all zero for a closed form
  // Against the reference, over the ticks in which either is in contact:
  double rms_N = 0.0, max_N = 0.0, jnd_p50 = 0.0, jnd_p99 = 0.0, share_above_1_jnd = 0.0;
  double direction_p50_deg = 0.0, direction_p99_deg = 0.0;  // where both press more than the JND floor
  double work_J = 0.0;  // the hand's over the path, by the trapezoidal rule
};

struct Comparison {
  std::string object;
  std::vector<ModelResult> models;
  std::size_t reference = 0;   // index into models
  std::string reference_text;  // what it is, and where it does not hold
  std::string note{};          // what was left out, and why; may be empty
  double jnd_floor_N = 0.0;
};

// Runs each model on an ideal device along the scene's path; an object with a path of its own goes along it
// in every model. Throws SceneError, std::runtime_error: no such object, one that moves freely, an object
// that cannot be rendered both ways (with the reason).
Comparison compare_models(const Scene& scene, const std::string& object, const Progress& progress);

// The pieces, for other comparisons.
// The scene on an ideal device, its forces neither clamped nor slewed.
Scene on_ideal_device(const Scene& scene);
// Fills what `model` has against the reference.
void measure(ModelResult& model, const ModelResult& reference, double floor_N);

}  // namespace hybrid
