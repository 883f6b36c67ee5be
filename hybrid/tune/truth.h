// SPDX-License-Identifier: GPL-3.0-or-later
// The truth with which settings are compared: the scene's own voxels with accurate energy and without
// thinning. In poses along the motion all tissue is at rest under the tool. The scene's voxels are data,
// because labels say nothing about the inside of a voxel. So two differences are kept apart. The difference
// of a setting from the scene is the error of the setting. The truth's own error is only that it is not quite
// at rest. The difference of the scene from tissue that is divided more finely is a property of the scene,
// and is the same for all settings.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "hybrid/tune/cache.h"
#include "hybrid/tune/felt_error.h"
#include "hybrid/tune/play.h"
#include "hybrid/tune/setting.h"

namespace hybrid {

inline constexpr int kTruthSplit = 2;  // parts of a voxel along each axis, for the error of the spacing

// Voxels of a reference: the labels at a setting's spacing, and then each voxel divided into split³ parts.
struct TruthGrid {
  Setting setting;
  int split = 1;
};

struct Truth {
  std::string words;  // its spacing and energy, in words
  std::string key;    // its part of the keys of cached records
  TruthGrid grid;
  ForceCourse course;  // along the scene's motion; at rest in its poses
  SettingError rest;   // estimated error from not being quite at rest
  // Properties of the scene, not errors of the truth. Empty: not measured. spacing: estimated difference from
  // voxels that are divided ever more finely and keep the shape. shape: difference if the labels are read at
  // half the spacing, both on voxels half as wide.
  std::optional<SettingError> spacing, shape;
  std::string not_measured;  // why `spacing` is empty
  [[nodiscard]] double error_jnd() const { return rest.worst_jnd(); }
};

// The input of measure_truth().
struct TruthPlan {
  const Scene& as_read;
  const std::vector<TunableObject>& objects;
  std::vector<std::string> names;  // of the tuned objects
  bool quick = false;              // fewer poses
  double floor_N = 0.04, dt_s = 1e-3;
};

// Runs one step of the search. `words` describe the step for the user. `weight` is its expected cost (1: a
// session at the scene's own spacing). `work` does it.
using Step = std::function<void(const std::string& words, double weight,
                                const std::function<void(const Progress&)>& work)>;

// The course of the truth on its own voxels along a motion. It comes from the cache if it is there.
RestCourse truth_course(const TruthPlan& plan, const Motion& motion, const std::string& motion_words,
                        const EvaluationCache& cache, const Step& step);

// Measures the truth, and its error (Richardson, from half of the time that each pose is held). In fewer
// poses it also measures the differences that come from the scene's spacing and shapes.
Truth measure_truth(const TruthPlan& plan, const Motion& motion, const EvaluationCache& cache,
                    const Step& step);

// Expected cost of measure_truth() (1: a session at the scene's own spacing), and of a truth_course() alone.
double truth_weight(const TruthPlan& plan);
double truth_course_weight(const TruthPlan& plan);

// Relative cost of a session whose spacing is `scale` times the scene's own.
double play_weight(double scale);

}  // namespace hybrid
