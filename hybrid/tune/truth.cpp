// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tune/truth.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>

namespace hybrid {
namespace {

// Orders of the errors. Spacing: the edge of a contact is known to one spacing, and so is, if the shapes
// differ, a surface. Both errors are of first order, for either energy.
constexpr double kSpacingOrder = 1.0;
// Slowness: between 5, 10 and 20 times slower the forces differ by 0.69 and 0.45 JND (p99, moving) and by
// 0.55 and 0.34 (still) in the starter scene of `compose`, which is order 0.6 and 0.7; 0.49 and 0.24, 0.32
// and 0.10 in ball-and-block, order 1 and more. The least one gives the largest error.
constexpr double kRestOrder = 0.6;
constexpr double kCoarser = 2.0;          // ratio of spacings where the voxels are not divided
constexpr double kMostTruthVoxels = 4e6;  // voxels are not divided if there would be more
constexpr double kSlowPlays = 0.4;        // assumed share of a path in contact, for the weight of a slow run
// Exponent of 1/scale; less than 3, because mainly the voxels near the contact cost time.
constexpr double kWeightPower = 1.5;

nlohmann::json course_json(const ForceCourse& course) {
  nlohmann::json j = nlohmann::json::array();
  for (const CourseTick& t : course) {
    j.push_back({t.device_m.x, t.device_m.y, t.device_m.z, t.force_N.x, t.force_N.y, t.force_N.z,
                 t.soft ? 1.0 : 0.0});
  }
  return j;
}

ForceCourse course_from(const nlohmann::json& j) {
  ForceCourse course;
  for (const auto& row : j) {
    const auto t = row.get<std::array<double, 7>>();
    course.push_back({{t[0], t[1], t[2]}, {t[3], t[4], t[5]}, t[6] != 0.0});
  }
  return course;
}

FeltError times(FeltError error, double factor) {
  error.p50_jnd *= factor;
  error.p99_jnd *= factor;
  error.max_jnd *= factor;
  return error;
}

// The error of the better of two runs, from their difference. The errors have the ratio 1 : ratio^order.
SettingError richardson(const SettingError& difference, double ratio, double order) {
  const double factor = 1.0 / (std::pow(ratio, order) - 1.0);
  return {times(difference.moving, factor), times(difference.still, factor)};
}

// The objects' own spacing times `scale`, as voxels.
Setting at_scale(const std::vector<TunableObject>& objects, double scale) {
  Setting setting;
  for (const TunableObject& object : objects) {
    setting.objects.push_back(scaled(object, scale));
    setting.objects.back().proxy = false;
  }
  return setting;
}

// The spacing of one setting over that of the other: geometric mean over the objects.
double ratio_of(const std::vector<TunableObject>& objects, const Setting& coarse, const Setting& fine) {
  double sum = 0.0;
  for (std::size_t n = 0; n < objects.size(); ++n) {
    sum += std::log(scale_of(objects[n], coarse.objects[n]) / scale_of(objects[n], fine.objects[n]));
  }
  return std::exp(sum / static_cast<double>(objects.size()));
}

// Do the shapes of the objects depend on the spacing at which their labels are read? The edges of a plain
// block are whole numbers of voxels at any spacing.
bool shapes_depend_on_spacing(const Scene& as_read, const std::vector<TunableObject>& objects) {
  const Setting own = at_scale(objects, 1.0), half = at_scale(objects, 1.0 / kTruthSplit);
  for (std::size_t n = 0; n < objects.size(); ++n) {
    if (own.objects[n] == half.objects[n]) continue;
    const auto soft = std::ranges::find(as_read.soft, objects[n].own.object, &SoftDescription::name);
    const auto* formula = std::get_if<voxel::Formula>(&soft->source);
    const bool plain = formula != nullptr && formula->shape == voxel::Formula::Shape::block &&
                       formula->layers.empty() && formula->inclusions.empty();
    if (!plain) return true;
  }
  return false;
}

}  // namespace

double play_weight(double scale) {
  return std::pow(scale, -kWeightPower);
}

double slow_weight(double scale, int slower) {
  return play_weight(scale) * (1.0 + kSlowPlays * slower);
}

double truth_weight(int split) {
  const double scale = 1.0 / split;
  // The truth, half as slow, and with other shapes; the undivided voxels.
  return slow_weight(scale, kTruthSlower) + 2.0 * slow_weight(scale, kTruthSlower / 2) +
         slow_weight(1.0, kTruthSlower);
}

int truth_split(const Scene& as_read, const std::vector<TunableObject>& objects,
                std::vector<std::string>& notes) {
  const BuiltScene built = build_scene(as_reference(as_read, own_setting(objects)));
  double voxels = 0.0;
  for (const auto& object : built.state->soft) voxels += static_cast<double>(object->lattice().voxel_count());
  if (voxels * std::pow(kTruthSplit, 3) <= kMostTruthVoxels) return kTruthSplit;
  notes.push_back(fmt::format(
      "the truth has the scene's own spacing, because voxels half as wide would be more than {:.0f} "
      "million",
      1e-6 * kMostTruthVoxels));
  return 1;
}

double Truth::error_jnd() const {
  return std::max(spacing.moving.p99_jnd + rest.moving.p99_jnd, spacing.still.p99_jnd + rest.still.p99_jnd);
}

ForceCourse slow_course(const TruthPlan& plan, const TruthGrid& grid, const Motion& motion,
                        const std::string& motion_words, int slower, const EvaluationCache& cache,
                        const Step& step) {
  const std::string key = fmt::format("slow {} {} {}\nsplit {}\n{}", slower, motion.ticks, motion_words,
                                      grid.split, as_toml(grid.setting));
  ForceCourse course;
  const double scale = scale_of(plan.objects.front(), grid.setting.objects.front()) / grid.split;
  const std::string words = fmt::format("the truth at {:.2g} of the own spacing, {} times slower{}", scale,
                                        slower, motion_words.empty() ? "" : ", " + motion_words);
  step(words, slow_weight(scale, slower), [&](const Progress& progress) {
    if (const auto kept = cache.find(key)) {
      course = course_from(*kept);
      return;
    }
    course = play_slowly(as_reference(plan.as_read, grid.setting, grid.split), plan.names, motion, slower,
                         progress);
    cache.keep(key, course_json(course));
  });
  return course;
}

namespace {

using Course = std::function<ForceCourse(const TruthGrid& grid, int slower)>;

SettingError differs(const ForceCourse& other, const Truth& truth, const TruthPlan& plan) {
  return felt_error(other, truth.course, plan.floor_N, plan.dt_s);
}

Truth truth_on(const TruthPlan& plan, const TruthGrid& grid, const Course& course) {
  Truth truth;
  truth.grid = grid;
  truth.course = course(grid, kTruthSlower);
  truth.rest = richardson(differs(course(grid, kTruthSlower / 2), truth, plan), 2.0, kRestOrder);
  return truth;
}

std::string words_of(const TruthPlan& plan, const TruthGrid& grid) {
  const Scene exact = as_reference(plan.as_read, grid.setting);
  Setting shown = grid.setting;
  for (ObjectSetting& object : shown.objects) {
    const auto soft = std::ranges::find(exact.soft, object.object, &SoftDescription::name);
    object = {object.object, false, object.spacing, soft->energy};
  }
  const std::string words = in_words(shown, plan.as_read.unit_m);
  return grid.split == 1
             ? words
             : fmt::format("{}, each voxel divided into {}", words, grid.split * grid.split * grid.split);
}

// The truth on divided voxels, or on the undivided ones.
Truth with_own_shapes(const TruthPlan& plan, const Course& course) {
  const TruthGrid undivided{at_scale(plan.objects, 1.0)};
  Truth truth = truth_on(plan, {undivided.setting, plan.split}, course);
  const SettingError off = differs(course(undivided, kTruthSlower), truth, plan);
  const auto ratio = static_cast<double>(plan.split);
  truth.spacing = richardson(off, ratio, kSpacingOrder);
  if (truth.rest.worst_jnd() <= kAtRest_jnd) return truth;
  Truth coarse = truth_on(plan, undivided, course);
  const double larger = std::pow(ratio, kSpacingOrder);  // its error over that of the divided voxels
  coarse.spacing = {times(truth.spacing.moving, larger), times(truth.spacing.still, larger)};
  return coarse.error_jnd() < truth.error_jnd() ? coarse : truth;
}

// The truth at the scene's own spacing, beside voxels twice as wide, whose shapes differ.
Truth with_other_shapes(const TruthPlan& plan, const Course& course) {
  const TruthGrid own{at_scale(plan.objects, 1.0)}, coarse{at_scale(plan.objects, kCoarser)};
  Truth truth = truth_on(plan, own, course);
  truth.own_shape = false;
  truth.spacing = richardson(differs(course(coarse, kTruthSlower), truth, plan),
                             ratio_of(plan.objects, coarse.setting, own.setting), kSpacingOrder);
  return truth;
}

}  // namespace

Truth measure_truth(const TruthPlan& plan, const Motion& motion, const EvaluationCache& cache,
                    const Step& step) {
  std::map<std::string, ForceCourse> played;
  const Course course = [&](const TruthGrid& grid, int slower) {
    ForceCourse& kept = played[fmt::format("{} {}\n{}", slower, grid.split, as_toml(grid.setting))];
    if (kept.empty()) kept = slow_course(plan, grid, motion, "", slower, cache, step);
    return kept;
  };
  Truth truth = plan.split > 1 ? with_own_shapes(plan, course) : with_other_shapes(plan, course);
  if (plan.split > 1 && shapes_depend_on_spacing(plan.as_read, plan.objects)) {
    // Both at half the truth's slowness, where the truth's shapes were played already.
    truth.shape =
        felt_error(course({at_scale(plan.objects, 1.0 / plan.split)}, kTruthSlower / 2),
                   course({truth.grid.setting, plan.split}, kTruthSlower / 2), plan.floor_N, plan.dt_s);
  }
  truth.words = words_of(plan, truth.grid);
  truth.key = fmt::format("split {}\n{}{}", truth.grid.split, as_toml(truth.grid.setting), motion.ticks);
  return truth;
}

}  // namespace hybrid
