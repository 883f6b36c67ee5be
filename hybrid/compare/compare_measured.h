// SPDX-License-Identifier: GPL-3.0-or-later
// The rendered force of a scene along a measured motion, against the force that was measured along it: the
// evaluation of Ruffaldi et al. 2006 (device/paths/trajectory_file.h).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "device/paths/trajectory_file.h"
#include "hybrid/compare/compare.h"

namespace hybrid {

struct MeasuredOptions {
  device::MeasuredFile measured;
  // File of the device's positions, if they differ from those where the forces were measured. In the
  // evaluation it is the in-trajectory, which lies below the surface by force / stiffness. Empty: the
  // positions of the measured file.
  std::filesystem::path along;
};

struct MeasuredComparison {
  Comparison comparison;           // two models: the scene, and the measurement, which is the reference
  double rms_N = 0.0;              // figure of the evaluation: over all samples, with contact or without
  std::size_t samples = 0;         // compared ticks
  std::size_t in_gaps = 0;         // ticks left out, because nothing was measured there
  std::vector<std::string> notes;  // on the files
};

// Runs on an ideal device at the scene's rate. Throws SceneError, device::PathError.
MeasuredComparison compare_measured(const Scene& scene, const MeasuredOptions& options,
                                    const Progress& progress);

}  // namespace hybrid
