// SPDX-License-Identifier: GPL-3.0-or-later
// One object of a scene, rendered by several models along the same motion.
//   Any object: mesh with a proxy; voxels, if the object has any; closed form, if there is one (ball, box or
//   block under a ball; flat punch on a block).
//   Rigid objects also: the surface nearest to the device, without a proxy (thesis, Fig 18).
//   Soft objects also: the algorithm of the thesis (voxel/baseline/thesis_chainmail.h).
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
      depth_m;  // depth of the device in the undeformed object, [row]; negative outside; empty where unknown
  Percentiles tick_us;  // all zero for a closed form
  // Differences from the reference, over the ticks in which at least one of the two has a force:
  double rms_N = 0.0, max_N = 0.0, jnd_p50 = 0.0, jnd_p99 = 0.0, share_above_1_jnd = 0.0;
  // Angle to the reference, over the ticks in which both forces exceed the JND floor.
  double direction_p50_deg = 0.0, direction_p99_deg = 0.0;
  double work_J = 0.0;  // work of the force on the hand along the path, by the trapezoidal rule
};

struct Comparison {
  std::string object;
  std::vector<ModelResult> models;
  std::size_t reference = 0;   // index into models
  std::string reference_text;  // the reference in words, with its simplifications
  std::string note{};          // models that were left out, and why; may be empty
  double jnd_floor_N = 0.0;
};

// Runs each model on an ideal device along the scene's path. An object with a path of its own follows it in
// every model. `object`: a name; empty: the first soft object, or else the first rigid one. Throws
// SceneError, std::runtime_error: there is no such object; it moves freely; or no model can render it (with
// the reason).
Comparison compare_models(const Scene& scene, const std::string& object, const Progress& progress);

// For other comparisons: the scene on an ideal device. Forces are neither clamped nor slewed.
Scene on_ideal_device(const Scene& scene);
// Fills the differences of `model` from the reference. `floor_N`: floor of the JND.
void measure(ModelResult& model, const ModelResult& reference, double floor_N);

}  // namespace hybrid
