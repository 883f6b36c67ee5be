// SPDX-License-Identifier: GPL-3.0-or-later
// The truth with which settings are compared, and the error of this truth. The truth is the scene with its
// own shapes on voxels half as wide, with accurate energy and without thinning, played slowly. Its voxels are
// those of the scene, each divided: with labels read at another spacing the objects themselves would change.
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

inline constexpr int kTruthSplit = 2;             // parts of a voxel along each axis
inline constexpr int kTruthSlower = 2 * kSlower;  // slow-down factor
inline constexpr double kAtRest_jnd = 0.5;        // accepted error of a truth from not being at rest

// Voxels of a reference: the labels at a setting's spacing, and then each voxel divided into split³ parts.
struct TruthGrid {
  Setting setting;
  int split = 1;
};

struct Truth {
  std::string words;  // its spacing and energy, in words
  std::string key;    // its part of the keys of cached records
  TruthGrid grid;
  ForceCourse course;  // along the scene's motion
  // Estimated error due to the spacing. own_shape: of the model alone, at the same shapes. If not, the shapes
  // differ, too, because dividing the voxels would make too many.
  SettingError spacing;
  bool own_shape = true;
  SettingError rest;  // estimated error due to playing at a finite speed
  // How far the truth changes if the labels are read at half the spacing. So much the shapes of the scene
  // depend on its spacing. It is no error of the truth, which has the scene's own shapes. Empty: they do not
  // depend on it, or it was not measured.
  std::optional<SettingError> shape;
  [[nodiscard]] double error_jnd()
      const;  // spacing and rest, for the kind of ticks where their sum is larger
};

// The input of measure_truth().
struct TruthPlan {
  const Scene& as_read;
  const std::vector<TunableObject>& objects;
  std::vector<std::string> names;  // of the tuned objects
  int split = kTruthSplit;         // from truth_split()
  double floor_N = 0.04, dt_s = 1e-3;
};

// Runs one step of the search. `words` describe the step for the user. `weight` is its expected cost (1: a
// session at the scene's own spacing). `work` does it.
using Step = std::function<void(const std::string& words, double weight,
                                const std::function<void(const Progress&)>& work)>;

// The course of the reference on this grid, played `slower` times slower. It comes from the cache if it is
// there.
ForceCourse slow_course(const TruthPlan& plan, const TruthGrid& grid, const Motion& motion,
                        const std::string& motion_words, int slower, const EvaluationCache& cache,
                        const Step& step);

// Measures the truth. Its error is extrapolated (Richardson) from two more runs: one on the undivided voxels,
// and one that is played twice as fast. If the truth does not come to rest, the undivided voxels are the
// truth if their error is less.
Truth measure_truth(const TruthPlan& plan, const Motion& motion, const EvaluationCache& cache,
                    const Step& step);

// kTruthSplit; or 1 if there would be too many voxels, which adds a note.
int truth_split(const Scene& as_read, const std::vector<TunableObject>& objects,
                std::vector<std::string>& notes);
// Expected cost of measure_truth() with these parts of a voxel (1: a session at the scene's own spacing).
double truth_weight(int split);

// Relative cost of a session whose spacing is `scale` times the scene's own. slow_weight(): that of a slow
// run.
double play_weight(double scale);
double slow_weight(double scale, int slower);

}  // namespace hybrid
