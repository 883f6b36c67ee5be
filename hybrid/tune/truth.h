// SPDX-License-Identifier: GPL-3.0-or-later
// The truth with which settings are compared, and the error of this truth. The truth is the scene at the
// finest spacing of the sweep, with accurate energy and without thinning, played slowly.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "hybrid/tune/cache.h"
#include "hybrid/tune/felt_error.h"
#include "hybrid/tune/play.h"
#include "hybrid/tune/setting.h"

namespace hybrid {

// Spacing as a multiple of the scene's own. It is greater if there would be too many voxels.
inline constexpr double kTruthScale = 0.75;
// At some spacings accurate energy never comes to rest under the tool: its force keeps jumping from voxel to
// voxel. Then these multiples of the first spacing are tried in this order.
inline constexpr double kOtherTruthScales[] = {7.0 / 6.0, 4.0 / 3.0};
inline constexpr double kAtRest_jnd = 0.5;        // accepted error of a truth from not being at rest
inline constexpr int kTruthSlower = 2 * kSlower;  // slow-down factor

struct Truth {
  std::string words;     // its spacing and energy, in words
  std::string key;       // its part of the keys of cached records
  Setting setting;       // with its spacing
  ForceCourse course;    // along the scene's motion
  double ratio = 1.0;    // spacing of the coarser run (measure_truth()) / spacing of the truth
  SettingError spacing;  // estimated error due to the spacing
  SettingError rest;     // estimated error due to playing at a finite speed
  [[nodiscard]] double error_jnd() const;  // sum of both errors, for the kind of ticks where it is larger
};

// The input of measure_truth().
struct TruthPlan {
  const Scene& as_read;
  const std::vector<TunableObject>& objects;
  std::vector<std::string> names;  // of the tuned objects
  double scale = kTruthScale;      // the first spacing that is tried, as a multiple of the scene's
  double floor_N = 0.04, dt_s = 1e-3;
};

// Runs one step of the search. `words` describe the step for the user. `weight` is its expected cost (1: a
// session at the scene's own spacing). `work` does it.
using Step = std::function<void(const std::string& words, double weight,
                                const std::function<void(const Progress&)>& work)>;

// The course of the reference at this setting, played `slower` times slower. It comes from the cache if it is
// there.
ForceCourse slow_course(const TruthPlan& plan, const Setting& setting, const Motion& motion,
                        const std::string& motion_words, int slower, const EvaluationCache& cache,
                        const Step& step);

// Measures the truth at the first of its spacings at which tissue comes to rest. If there is none, the
// spacing that is nearest to rest is used. The error of the truth is extrapolated (Richardson) from two more
// runs: one with voxels twice as wide, and one that is played twice as fast.
Truth measure_truth(const TruthPlan& plan, const Motion& motion, const EvaluationCache& cache,
                    const Step& step);

// Scale of the truth's spacing to begin with: kTruthScale, or more if there would be too many voxels, which
// adds a note.
double first_truth_scale(const Scene& as_read, const std::vector<TunableObject>& objects,
                         std::vector<std::string>& notes);
// Expected cost of measure_truth() that begins at this scale (1: a session at the scene's own spacing).
double truth_weight(double scale);

// Relative cost of a session whose spacing is `scale` times the scene's own. slow_weight(): that of a slow
// run.
double play_weight(double scale);
double slow_weight(double scale, int slower);

}  // namespace hybrid
