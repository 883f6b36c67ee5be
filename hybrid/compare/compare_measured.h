// SPDX-License-Identifier: GPL-3.0-or-later
// What a scene makes the hand feel along a measured motion, against the force that was measured on it: the
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
  // Where the device was, when not where the forces were measured: the in-trajectory of the evaluation, which
  // lies below the surface by force / stiffness. Empty: the measured file's own positions.
  std::filesystem::path along;
};

struct MeasuredComparison {
  Comparison comparison;           // models: the scene, and what was measured, which is the reference
  double rms_N = 0.0;              // the evaluation's figure: over every sample, in contact or not
  std::size_t samples = 0;         // compared ticks
  std::size_t in_gaps = 0;         // ticks left out, as nothing was measured there
  std::vector<std::string> notes;  // of the files
};

// On an ideal device at the scene's rate. Throws SceneError, device::PathError.
MeasuredComparison compare_measured(const Scene& scene, const MeasuredOptions& options,
                                    const Progress& progress);

}  // namespace hybrid
