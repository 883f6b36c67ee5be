// SPDX-License-Identifier: GPL-3.0-or-later
// The truth that settings are compared with: the scene at the finest spacing of the sweep, with accurate
// energy and without thinning, played slowly; and the error of that truth itself.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "hybrid/tune/cache.h"
#include "hybrid/tune/felt_error.h"
#include "hybrid/tune/play.h"
#include "hybrid/tune/setting.h"

namespace hybrid {

// Spacing in the scene's own; wider where there would be too many voxels.
inline constexpr double kTruthScale = 0.75;
// At some spacings accurate energy never rests under the tool: its force keeps jumping from voxel to voxel.
// Then these are tried, in this order, times the first one.
inline constexpr double kOtherTruthScales[] = {7.0 / 6.0, 4.0 / 3.0};
inline constexpr double kAtRest_jnd = 0.5;        // error of its rest that a truth may have
inline constexpr int kTruthSlower = 2 * kSlower;  // times

struct Truth {
  std::string words;     // its spacing and energy
  std::string key;       // all that it depends on, as the cache has it
  Setting setting;       // of its spacing
  ForceCourse course;    // along the scene's motion
  double ratio = 1.0;    // of the wider voxels, from which its error is estimated, to its own
  SettingError spacing;  // estimated error of its spacing
  SettingError rest;     // estimated error of playing it at a finite speed
  [[nodiscard]] double error_jnd() const;  // both, of the kind with the larger sum
};

// What plays take part in the progress.
struct TruthPlan {
  const Scene& as_read;
  const std::vector<TunableObject>& objects;
  std::vector<std::string> names;  // of the objects
  double scale = kTruthScale;      // the first one that is tried
  double floor_N = 0.04, dt_s = 1e-3;
};

// A step of the search: its words, its weight (1: a session at the scene's own spacing), and its work.
using Step = std::function<void(const std::string& words, double weight,
                                const std::function<void(const Progress&)>& work)>;

// The course of a setting's reference played `slower` times slower, from the cache or anew.
ForceCourse slow_course(const TruthPlan& plan, const Setting& setting, const Motion& motion,
                        const std::string& motion_words, int slower, const EvaluationCache& cache,
                        const Step& step);

// The truth at the first of its spacings that comes to rest; if none does, at the one that is nearest to
// rest. Its own error is extrapolated (Richardson) from two more runs: one with voxels twice as wide, and one
// played twice as fast.
Truth measure_truth(const TruthPlan& plan, const Motion& motion, const EvaluationCache& cache,
                    const Step& step);

// Relative weight of a session at so many times the own spacing.
double play_weight(double scale);
double slow_weight(double scale, int slower);

}  // namespace hybrid
