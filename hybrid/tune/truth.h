// SPDX-License-Identifier: GPL-3.0-or-later
// The truth that settings are compared with: the scene at a finer spacing than any setting, with accurate
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

// Voxels are as wide as this share of the scene's own, or wider where there would be too many.
inline constexpr double kTruthScale = 0.5, kQuickTruthScale = 0.75;

struct Truth {
  std::string words;     // its spacing and energy
  std::string key;       // all that it depends on, as the cache has it
  Setting setting;       // of its spacing
  ForceCourse course;    // along the scene's motion
  double ratio = 1.0;    // of the coarser spacing, by which its error is estimated, to its own
  SettingError spacing;  // estimated error of its spacing
  SettingError rest;     // estimated error of playing it at a finite speed
  [[nodiscard]] double error_jnd() const;  // both, of the kind with the larger sum
};

// What plays take part in the progress.
struct TruthPlan {
  const Scene& as_read;
  const std::vector<TunableObject>& objects;
  std::vector<std::string> names;  // of the objects
  double scale = kTruthScale;
  double floor_N = 0.04, dt_s = 1e-3;
};

// A step of the search: its words, its weight (1: a session at the scene's own spacing), and its work.
using Step = std::function<void(const std::string& words, double weight,
                                const std::function<void(const Progress&)>& work)>;

// The course of a setting's reference played `slower` times slower, from the cache or anew.
ForceCourse slow_course(const TruthPlan& plan, const Setting& setting, const Motion& motion,
                        const std::string& motion_words, int slower, const EvaluationCache& cache,
                        const Step& step);

// Its own error is that of three runs: a spacing twice as coarse gives the error of the spacing, and that one
// played half as fast the error of the speed. Both are extrapolated at first order (Richardson).
Truth measure_truth(const TruthPlan& plan, const Motion& motion, const EvaluationCache& cache,
                    const Step& step);

// Relative weight of a session at so many times the own spacing.
double play_weight(double scale);

}  // namespace hybrid
