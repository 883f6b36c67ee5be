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

// Orders of the errors. Spacing: the edge of a contact is known to one spacing, an error of first order for
// either energy. Rest: the least measured order at which the force approaches rest with the time of a hold.
constexpr double kSpacingOrder = 1.0, kRestOrder = 0.6;
// Numbers of poses of the truth in which the device moves, large enough that p99 is not decided by a single
// pose.
constexpr int kPoses = 128, kQuickPoses = 64;
// Every kPosesApart-th of these poses is also taken on other voxels.
constexpr int kPosesApart = 6;
// Factors by which the device is slower between poses: of the truth, and on other voxels. The speed matters
// little if the device rests in poses longer than it moves. So it is less slow on the large lattices of other
// voxels.
constexpr int kSlowerBetween = 10, kSlowerApart = 2;
constexpr double kMostVoxels = 4e6;   // voxels are not divided if there would be more
constexpr double kPoseWeight = 0.25;  // cost of a pose, if that of a session at the same spacing is 1
constexpr double kSlowPlays = 0.4;    // assumed share of a path in contact
// Exponents of 1/scale in the cost of a session and of a pose. The first is below 3, because mainly the
// voxels near the contact cost time.
constexpr double kWeightPower = 1.5, kPosePower = 3.0;

nlohmann::json course_json(const RestCourse& played) {
  nlohmann::json j = nlohmann::json::array();
  for (std::size_t t = 0; t < played.course.size(); ++t) {
    const CourseTick& c = played.course[t];
    const glm::dvec3& half_N = played.halfway[t].force_N;
    j.push_back({c.device_m.x, c.device_m.y, c.device_m.z, c.force_N.x, c.force_N.y, c.force_N.z,
                 c.soft ? 1.0 : 0.0, c.at_rest ? 1.0 : 0.0, half_N.x, half_N.y, half_N.z,
                 played.poses.held[t] ? 1.0 : 0.0, played.poses.near[t] ? 1.0 : 0.0,
                 played.poses.stops[t] ? 1.0 : 0.0});
  }
  return j;
}

RestCourse course_from(const nlohmann::json& j) {
  RestCourse played;
  for (const auto& row : j) {
    const auto t = row.get<std::array<double, 14>>();
    played.course.push_back({{t[0], t[1], t[2]}, {t[3], t[4], t[5]}, t[6] != 0.0, t[7] != 0.0});
    played.halfway.push_back(played.course.back());
    played.halfway.back().force_N = {t[8], t[9], t[10]};
    played.poses.held.push_back(t[11] != 0.0);
    played.poses.near.push_back(t[12] != 0.0);
    played.poses.stops.push_back(t[13] != 0.0);
  }
  return played;
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

namespace {

double rest_weight(double scale, int poses, int slower) {
  return play_weight(scale) * (1.0 + kSlowPlays * slower) +
         kPoseWeight * poses * std::pow(scale, -kPosePower);
}

int poses_of(const TruthPlan& plan) {
  return plan.quick ? kQuickPoses : kPoses;
}

std::string words_of(const TruthPlan& plan, const TruthGrid& grid) {
  const Scene exact = as_reference(plan.as_read, grid.setting);
  Setting shown = grid.setting;
  for (ObjectSetting& object : shown.objects) {
    const auto soft = std::ranges::find(exact.soft, object.object, &SoftDescription::name);
    object = {object.object, false, object.spacing, soft->energy};
  }
  return in_words(shown, plan.as_read.unit_m);
}

// The poses along a motion, from a session at normal speed.
Poses find_poses(const TruthPlan& plan, const Motion& motion, const Progress& progress) {
  const Scene scene = as_reference(plan.as_read, at_scale(plan.objects, 1.0));
  const bool bodies_move = std::ranges::any_of(scene.rigid, [](const RigidDescription& rigid) {
    return !std::holds_alternative<std::monostate>(rigid.motion);
  });
  return poses_along(play_setting(scene, plan.names, motion, progress).course, plan.dt_s, bodies_move,
                     poses_of(plan));
}

// The course on this grid, from the cache if it is there. `at`: finds the poses. `count`: their approximate
// number.
RestCourse course_on(const TruthPlan& plan, const TruthGrid& grid, const Motion& motion,
                     const std::string& motion_words, int count, int slower,
                     const std::function<Poses(const Progress&)>& at, const EvaluationCache& cache,
                     const Step& step) {
  const std::string key = fmt::format("rest {} {} {} {}\nsplit {}\n{}", slower, count, motion.ticks,
                                      motion_words, grid.split, as_toml(grid.setting));
  const double scale = scale_of(plan.objects.front(), grid.setting.objects.front()) / grid.split;
  const std::string words = fmt::format("at rest in some {} poses on {:.2g} of the own spacing{}", count,
                                        scale, motion_words.empty() ? "" : ", " + motion_words);
  RestCourse played;
  step(words, rest_weight(scale, count, slower), [&](const Progress& progress) {
    if (const auto kept = cache.find(key)) {
      played = course_from(*kept);
      return;
    }
    const Poses poses = at(progress);
    played = play_to_rest(as_reference(plan.as_read, grid.setting, grid.split), plan.names, motion, poses,
                          slower, progress);
    cache.keep(key, course_json(played));
  });
  return played;
}

// Difference of `course` from `reference` in ticks in which both are at rest.
SettingError difference(const TruthPlan& plan, const ForceCourse& course, ForceCourse reference) {
  for (std::size_t t = 0; t < reference.size(); ++t) reference[t].at_rest &= course[t].at_rest;
  return felt_error(course, reference, plan.floor_N, plan.dt_s);
}

// The reason why the voxels cannot be divided; empty: they can.
std::string too_many_voxels(const TruthPlan& plan) {
  const BuiltScene built = build_scene(as_reference(plan.as_read, own_setting(plan.objects)));
  double voxels = 0.0;
  for (const auto& object : built.state->soft) voxels += static_cast<double>(object->lattice().voxel_count());
  if (voxels * std::pow(kTruthSplit, 3) <= kMostVoxels) return {};
  return fmt::format("voxels half as wide would be more than {:.0f} million", 1e-6 * kMostVoxels);
}

}  // namespace

double truth_course_weight(const TruthPlan& plan) {
  return 1.0 + rest_weight(1.0, poses_of(plan), kSlowerBetween);
}

double truth_weight(const TruthPlan& plan) {
  const double apart = rest_weight(1.0 / kTruthSplit, poses_of(plan) / kPosesApart, kSlowerApart);
  return truth_course_weight(plan) + (plan.quick ? 1.0 : 2.0) * apart;
}

RestCourse truth_course(const TruthPlan& plan, const Motion& motion, const std::string& motion_words,
                        const EvaluationCache& cache, const Step& step) {
  const auto poses = [&](const Progress& progress) { return find_poses(plan, motion, progress); };
  return course_on(plan, {at_scale(plan.objects, 1.0)}, motion, motion_words, poses_of(plan), kSlowerBetween,
                   poses, cache, step);
}

Truth measure_truth(const TruthPlan& plan, const Motion& motion, const EvaluationCache& cache,
                    const Step& step) {
  Truth truth;
  truth.grid = {at_scale(plan.objects, 1.0)};
  RestCourse own = truth_course(plan, motion, "", cache, step);
  truth.rest = richardson(felt_error(own.halfway, own.course, plan.floor_N, plan.dt_s), 2.0, kRestOrder);
  truth.course = std::move(own.course);
  truth.words = words_of(plan, truth.grid);
  truth.key = fmt::format("{}{} {}", as_toml(truth.grid.setting), motion.ticks, poses_of(plan));
  truth.not_measured = too_many_voxels(plan);
  if (!truth.not_measured.empty()) return truth;
  const auto fewer = [&](const Progress&) { return every_nth(own.poses, kPosesApart); };
  const auto apart = [&](const TruthGrid& grid) {
    return course_on(plan, grid, motion, "", poses_of(plan) / kPosesApart, kSlowerApart, fewer, cache, step)
        .course;
  };
  const ForceCourse divided = apart({truth.grid.setting, kTruthSplit});
  // At first order, the error of the voxels that are divided in two is the difference of both runs. The error
  // of the scene's own voxels is twice as large.
  const SettingError finer = richardson(difference(plan, truth.course, divided), kTruthSplit, kSpacingOrder);
  const double larger = std::pow(kTruthSplit, kSpacingOrder);
  truth.spacing = {times(finer.moving, larger), times(finer.still, larger)};
  if (!plan.quick && shapes_depend_on_spacing(plan.as_read, plan.objects))
    truth.shape = difference(plan, apart({at_scale(plan.objects, 1.0 / kTruthSplit)}), divided);
  return truth;
}

}  // namespace hybrid
