// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tune/truth.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

namespace hybrid {
namespace {

// Orders of the errors. Spacing: a voxel surface lies within half a spacing of the true one, and the edge of
// a contact is known to one spacing. Both errors are of first order, for either energy.
constexpr double kSpacingOrder = 1.0;
// Slowness: tissue comes to rest by diffusion, so the lag falls with the square root of the time. In a press
// on fine trilinear voxels the lag was 0.070, 0.048, 0.037 and 0.021 N when played 10, 20, 40 and 80 times
// slower.
constexpr double kRestOrder = 0.5;
// Ratio of spacings. A smaller ratio would amplify the noise that the grid's position causes.
constexpr double kCoarser = 2.0;
constexpr double kMostTruthVoxels = 4e6;  // the truth is made coarser than kTruthScale if it had more
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

Setting at_scale(const std::vector<TunableObject>& objects, double scale) {
  Setting setting;
  for (const TunableObject& object : objects) setting.objects.push_back(scaled(object, scale));
  return setting;
}

Setting coarser(const std::vector<TunableObject>& objects, const Setting& setting) {
  Setting coarse;
  for (std::size_t n = 0; n < objects.size(); ++n)
    coarse.objects.push_back(scaled(objects[n], kCoarser * scale_of(objects[n], setting.objects[n])));
  return coarse;
}

// The spacing of one setting over that of the other: geometric mean over the objects.
double ratio_of(const std::vector<TunableObject>& objects, const Setting& coarse, const Setting& fine) {
  double sum = 0.0;
  for (std::size_t n = 0; n < objects.size(); ++n) {
    sum += std::log(scale_of(objects[n], coarse.objects[n]) / scale_of(objects[n], fine.objects[n]));
  }
  return std::exp(sum / static_cast<double>(objects.size()));
}

}  // namespace

double play_weight(double scale) {
  return std::pow(scale, -kWeightPower);
}

double slow_weight(double scale, int slower) {
  return play_weight(scale) * (1.0 + kSlowPlays * slower);
}

double truth_weight(double scale) {
  return slow_weight(scale, kTruthSlower) + slow_weight(scale, kTruthSlower / 2) +
         slow_weight(kCoarser * scale, kTruthSlower);
}

double first_truth_scale(const Scene& as_read, const std::vector<TunableObject>& objects,
                         std::vector<std::string>& notes) {
  const BuiltScene built = build_scene(as_reference(as_read, own_setting(objects)));
  double voxels = 0.0;
  for (const auto& object : built.state->soft) voxels += static_cast<double>(object->lattice().voxel_count());
  const double scale = std::max(kTruthScale, std::cbrt(voxels / kMostTruthVoxels));
  if (scale > kTruthScale) {
    notes.push_back(
        fmt::format("the truth has {:.2f} of the own spacing, not {:.2f}: it would have more than {:.0f} "
                    "million voxels",
                    scale, kTruthScale, 1e-6 * kMostTruthVoxels));
  }
  return scale;
}

double Truth::error_jnd() const {
  return std::max(spacing.moving.p99_jnd + rest.moving.p99_jnd, spacing.still.p99_jnd + rest.still.p99_jnd);
}

ForceCourse slow_course(const TruthPlan& plan, const Setting& setting, const Motion& motion,
                        const std::string& motion_words, int slower, const EvaluationCache& cache,
                        const Step& step) {
  const std::string key =
      fmt::format("slow {} {} {}\n{}", slower, motion.ticks, motion_words, as_toml(setting));
  ForceCourse course;
  const double scale = scale_of(plan.objects.front(), setting.objects.front());
  const std::string words = fmt::format("the truth at {:.2g} of the own spacing, {} times slower{}", scale,
                                        slower, motion_words.empty() ? "" : ", " + motion_words);
  step(words, slow_weight(scale, slower), [&](const Progress& progress) {
    if (const auto kept = cache.find(key)) {
      course = course_from(*kept);
      return;
    }
    course = play_slowly(as_reference(plan.as_read, setting), plan.names, motion, slower, progress);
    cache.keep(key, course_json(course));
  });
  return course;
}

namespace {

using Course = std::function<ForceCourse(const Setting& setting, int slower)>;

SettingError differs(const ForceCourse& other, const Truth& truth, const TruthPlan& plan) {
  return felt_error(other, truth.course, plan.floor_N, plan.dt_s);
}

Truth truth_at(const TruthPlan& plan, const Setting& setting, const Course& course) {
  Truth truth;
  truth.setting = setting;
  truth.course = course(setting, kTruthSlower);
  truth.rest = richardson(differs(course(setting, kTruthSlower / 2), truth, plan), 2.0, kRestOrder);
  return truth;
}

std::string words_of(const TruthPlan& plan, const Setting& setting) {
  const Scene exact = as_reference(plan.as_read, setting);
  Setting shown = setting;
  for (ObjectSetting& object : shown.objects) {
    const auto soft = std::ranges::find(exact.soft, object.object, &SoftDescription::name);
    object = {object.object, false, object.spacing, soft->energy};
  }
  return in_words(shown, plan.as_read.unit_m);
}

}  // namespace

Truth measure_truth(const TruthPlan& plan, const Motion& motion, const EvaluationCache& cache,
                    const Step& step) {
  const Course course = [&](const Setting& setting, int slower) {
    return slow_course(plan, setting, motion, "", slower, cache, step);
  };
  Truth truth = truth_at(plan, at_scale(plan.objects, plan.scale), course);
  std::vector<Setting> tried{truth.setting};
  for (const double other : kOtherTruthScales) {
    if (truth.rest.worst_jnd() <= kAtRest_jnd) break;
    const Setting setting = at_scale(plan.objects, other * plan.scale);
    if (std::ranges::find(tried, setting) != tried.end()) continue;
    tried.push_back(setting);
    Truth next = truth_at(plan, setting, course);
    if (next.rest.worst_jnd() < truth.rest.worst_jnd()) truth = std::move(next);
  }
  const Setting coarse = coarser(plan.objects, truth.setting);
  truth.ratio = ratio_of(plan.objects, coarse, truth.setting);
  truth.spacing = richardson(differs(course(coarse, kTruthSlower), truth, plan), truth.ratio, kSpacingOrder);
  truth.words = words_of(plan, truth.setting);
  truth.key = fmt::format("{}{}", as_toml(truth.setting), motion.ticks);
  return truth;
}

}  // namespace hybrid
