// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/models/models_in_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <stdexcept>

#include "device/loop/stop_signal.h"
#include "hybrid/feel/just_noticeable.h"
#include "hybrid/models/variants.h"
#include "hybrid/tune/evaluation.h"
#include "hybrid/tune/progress.h"

namespace hybrid {
namespace {

// Timed sessions of each variant; odd, so that a median is one of them.
constexpr std::size_t kPasses = 3;

// An object of the built scene as given.
struct GivenObject {
  std::string name;
  bool touched = false;
  glm::dvec3 extent_m{0.0};  // edges of the box around the drawn surface of a rigid object
};

glm::dvec3 extent_of(const RigidObject& object) {
  if (object.drawn == nullptr || object.drawn->vertices.empty()) return glm::dvec3(0.0);
  glm::dvec3 low = object.drawn->vertices.front(), high = low;
  for (const glm::dvec3& v : object.drawn->vertices) {
    low = glm::min(low, v);
    high = glm::max(high, v);
  }
  return high - low;
}

std::vector<GivenObject> play_as_given(const Scene& scene, const Motion& motion, const Progress& progress) {
  BuiltScene built = build_scene(scene, progress);
  SessionOptions options;
  options.seconds = static_cast<double>(motion.ticks) / scene.rate_hz;
  options.keep_recording = false;
  options.async_relaxation = true;
  options.path = motion.path;
  options.progress = progress;
  const SessionResult result = run_session(scene, built, options);
  std::vector<GivenObject> objects;
  for (const RigidObject& object : built.world->rigid)
    objects.push_back({.name = object.name, .extent_m = extent_of(object)});
  for (const SoftBody& object : built.world->soft) objects.push_back({.name = object.name});
  for (std::size_t o = 0; o < objects.size(); ++o) objects[o].touched = result.object_contact_ticks.at(o) > 0;
  return objects;
}

// Depth of the tool in the object. `proxy`: forces of a coupling of `stiffness_N_per_m` on the rigid surface.
std::vector<double> depths_of(const ForceCourse& proxy, double stiffness_N_per_m) {
  std::vector<double> depth_m;
  for (const CourseTick& tick : proxy) depth_m.push_back(glm::length(tick.force_N) / stiffness_N_per_m);
  return depth_m;
}

// Travel of the device since the contact began, opposite to the mean force.
std::vector<double> travel_of(const ForceCourse& course, const TickRange& contact) {
  glm::dvec3 force(0.0);
  for (std::size_t t = contact.begin; t < contact.end; ++t) force += course[t].force_N;
  std::vector<double> travel_m;
  if (glm::length(force) == 0.0) return travel_m;
  const glm::dvec3 into = -glm::normalize(force);
  for (const CourseTick& tick : course)
    travel_m.push_back(glm::dot(tick.device_m - course[contact.begin].device_m, into));
  return travel_m;
}

FeltModel felt_of(const ForceCourse& course, const ObjectModels& object, double floor_N, double dt_s) {
  FeltModel felt;
  std::vector<double> force_N, angle_deg;
  for (std::size_t t = 0; t < std::min(course.size(), object.reference.size()); ++t) {
    const CourseTick &tick = course[t], &reference = object.reference[t];
    const double size_N = glm::length(tick.force_N);
    if (!tick.soft && !reference.soft) continue;
    if (tick.soft && size_N > 0.0) force_N.push_back(size_N);
    if (size_N > floor_N && !felt.onset_s) felt.onset_s = static_cast<double>(t) * dt_s;
    if (size_N > kLeastDirected_N && glm::length(reference.force_N) > kLeastDirected_N)
      angle_deg.push_back(angle_between_deg(tick.force_N, reference.force_N));
  }
  const Percentiles force = percentiles(force_N);
  felt.force_p50_N = force.p50;
  felt.force_max_N = force.max;
  if (!angle_deg.empty()) {
    const Percentiles angle = percentiles(angle_deg);
    felt.direction_p50_deg = angle.p50;
    felt.direction_p99_deg = angle.p99;
  }
  if (object.contact) felt.stiffness_N_per_m = felt_stiffness(course, object.depth_m, *object.contact);
  felt.error = felt_error(course, object.reference, floor_N, dt_s);
  return felt;
}

class ModelsRun {
 public:
  ModelsRun(const Scene& as_read, const ModelsOptions& options)
      : options_(options), scene_(as_read), progress_(options.progress), step_(progress_.as_step()) {
    result_.floor_N = jnd_floor_N(as_read);
    result_.dt_s = 1.0 / as_read.rate_hz;
    result_.stiffness_N_per_m = as_read.tool.stiffness_N_per_m;
    objects_ = tunable_objects(scene_);
    const Scene own = as_given(scene_, objects_, {}).scene;
    motion_ = scene_motion(own);
    step_("the scene as given", 1.0,
          [&](const Progress& progress) { given_ = play_as_given(own, motion_, progress); });
    open_proxies();
  }

  ModelsInScene run() {
    std::vector<GivenObject> compared = compared_objects();
    // Soft objects come first, because their models differ most.
    std::ranges::stable_sort(compared, {}, [&](const GivenObject& o) { return soft_index(o.name) ? 0 : 1; });
    plan(compared.size());
    find_reference(touches_soft());
    for (const GivenObject& object : compared) result_.objects.push_back(compare(object));
    result_.tunable = objects_;
    return std::move(result_);
  }

 private:
  [[nodiscard]] bool touched(const std::string& name) const {
    return std::ranges::any_of(given_, [&](const GivenObject& o) { return o.touched && o.name == name; });
  }
  [[nodiscard]] std::optional<std::size_t> soft_index(const std::string& name) const {
    for (std::size_t n = 0; n < objects_.size(); ++n) {
      if (objects_[n].own.object == name) return n;
    }
    return {};
  }
  [[nodiscard]] bool touches_soft() const {
    return std::ranges::any_of(objects_, [&](const TunableObject& o) { return touched(o.own.object); });
  }

  // A soft object that the scene renders by the proxy gets voxels as its other model, if the path touches it.
  void open_proxies() {
    std::vector<std::string> opened;
    for (SoftDescription& soft : scene_.soft) {
      if (soft.model != SoftModel::proxy || !touched(soft.name)) continue;
      soft.model = SoftModel::voxels;
      opened.push_back(soft.name);
    }
    if (opened.empty()) return;
    objects_ = tunable_objects(scene_);
    for (TunableObject& object : objects_) {
      if (std::ranges::find(opened, object.own.object) == opened.end()) continue;
      object.own.proxy = true;
      object.model_written = true;
    }
  }

  // The objects to compare. Adds the others to the result.
  std::vector<GivenObject> compared_objects() {
    std::vector<GivenObject> compared;
    std::string names;
    for (const GivenObject& object : given_) {
      names += fmt::format(" \"{}\"", object.name);
      if (!object.touched) {
        result_.untouched.push_back(object.name);
      } else if (options_.object.empty() || object.name == options_.object) {
        compared.push_back(object);
      }
    }
    if (!compared.empty()) return compared;
    const std::string file = scene_.file.string();
    if (options_.object.empty()) {
      throw std::runtime_error(fmt::format(
          "{}: its path touches nothing; give [path] points within an object (`hybrid check` says where they "
          "lie)",
          file));
    }
    const bool known = std::ranges::find(given_, options_.object, &GivenObject::name) != given_.end();
    throw std::runtime_error(
        known ? fmt::format("{}: its path does not touch \"{}\"; choose another object "
                            "with --object, or change [path]",
                            file, options_.object)
              : fmt::format("{}: no object \"{}\"; it has{}", file, options_.object, names));
  }

  void plan(std::size_t compared) {
    constexpr double kUsualRows = 7.0;  // usual number of models of an object
    progress_.plan(static_cast<double>(compared) * kUsualRows * static_cast<double>(kPasses));
    if (!touches_soft()) return;
    progress_.plan(truth_weight(truth_plan()));
  }

  void find_reference(bool soft) {
    if (!soft) return;
    const EvaluationCache cache(options_.cache, scene_);
    result_.truth = measure_truth(truth_plan(), motion_, cache, step_);
  }

  [[nodiscard]] TruthPlan truth_plan() const {
    TruthPlan plan{.as_read = scene_,
                   .objects = objects_,
                   .names = {},
                   .floor_N = result_.floor_N,
                   .dt_s = result_.dt_s};
    for (const TunableObject& object : objects_) plan.names.push_back(object.own.object);
    return plan;
  }

  // Plays every pass of the variants. Each pass has the reverse order of the one before, so that a machine
  // that gets slower or faster favours none.
  void play(std::vector<Variant>& variants, std::vector<ModelRow>& rows, const std::string& object) {
    std::vector<std::vector<std::vector<double>>> passes(variants.size());
    std::vector<std::size_t> order;
    for (std::size_t n = 0; n < variants.size(); ++n) {
      rows.push_back({.name = variants[n].name, .words = variants[n].words, .setting = variants[n].setting});
      rows.back().left_out = variants[n].left_out;
      order.push_back(n);
    }
    const std::size_t first = rows.size() - variants.size();
    for (std::size_t pass = 0; pass < kPasses; ++pass) {
      for (const std::size_t n : order) play_once(variants[n], rows[first + n], passes[n], object);
      std::ranges::reverse(order);
    }
    for (std::size_t n = 0; n < variants.size(); ++n) {
      if (rows[first + n].left_out.empty()) rows[first + n].tick_us = median_ticks(passes[n]);
    }
  }

  void play_once(const Variant& variant, ModelRow& row, std::vector<std::vector<double>>& passes,
                 const std::string& object) {
    if (!row.left_out.empty()) return;
    step_(object + " " + variant.name, 1.0, [&](const Progress& progress) {
      try {
        Played played = play_setting(variant.scene, {object}, motion_, progress);
        passes.push_back(std::move(played.tick_us));
        row.course = std::move(played.course);
        row.load_s = passes.size() == 1 ? played.load_s : std::min(row.load_s, played.load_s);
        row.memory_bytes = played.memory_bytes;
        row.soft_voxels = played.soft_voxels;
        row.faults = std::move(played.faults);
      } catch (const device::StopAsked&) {
        throw;
      } catch (const std::exception& error) {
        if (variant.name == kAsGiven) throw;
        row.left_out = error.what();
      }
    });
  }

  // The reference's course, with marks at the ticks in which the object is touched. A tick is marked if the
  // scene as given touches the object. If the path touches no other soft object, ticks in which the reference
  // touches anything soft are marked too.
  [[nodiscard]] ForceCourse reference_for(const std::string& object, const ForceCourse& given) const {
    if (!result_.truth) return given;
    ForceCourse reference = result_.truth->course;
    const auto soft_touched =
        std::ranges::count_if(objects_, [&](const TunableObject& o) { return touched(o.own.object); });
    const bool alone = soft_touched == 1 && soft_index(object).has_value();
    for (std::size_t t = 0; t < reference.size(); ++t)
      reference[t].soft = (alone && reference[t].soft) || (t < given.size() && given[t].soft);
    return reference;
  }

  [[nodiscard]] std::vector<Variant> variants_of(const GivenObject& object) const {
    std::vector<Variant> variants{as_given(scene_, objects_, object.name)};
    if (const auto index = soft_index(object.name)) {
      for (Variant& variant : soft_variants(scene_, objects_, *index)) variants.push_back(std::move(variant));
    } else {
      variants.push_back(voxel_variant(scene_, object.name, object.extent_m));
    }
    return variants;
  }

  // Stiffness of the coupling in contact with the object as a proxy feels it.
  [[nodiscard]] double stiffness_on(const std::string& name) const {
    const auto rigid = std::ranges::find(scene_.rigid, name, &RigidDescription::name);
    const double own = rigid != scene_.rigid.end() ? rigid->feel.stiffness_N_per_m : 0.0;
    return own > 0.0 ? own : result_.stiffness_N_per_m;
  }

  void find_depth(ObjectModels& object) const {
    const auto proxy = std::ranges::find(object.rows, kProxyVariant, &ModelRow::name);
    const ModelRow& rigid =
        proxy != object.rows.end() && proxy->left_out.empty() ? *proxy : object.rows.front();
    const auto index = soft_index(object.object);
    object.depth_from_proxy = &rigid != object.rows.data() || !index || objects_[*index].own.proxy;
    if (object.depth_from_proxy) {
      object.depth_m = depths_of(rigid.course, stiffness_on(object.object));
      if (object.contact && !object.rigid) {
        object.match = match_stiffness(object.reference, rigid.course, result_.stiffness_N_per_m,
                                       *object.contact, result_.dt_s);
      }
    } else if (object.contact) {
      object.depth_m = travel_of(object.reference, *object.contact);
    }
  }

  void play_matched(ObjectModels& object, const Variant& proxy) {
    Variant matched{.name = kMatchedVariant, .words = "rigid"};
    if (object.match) {
      matched = matched_variant(proxy, object.match->stiffness_N_per_m);
    } else {
      matched.left_out = proxy.left_out.empty()
                             ? "the contact has no force over depth to which it could be fitted"
                             : proxy.left_out;
    }
    std::vector<Variant> one{std::move(matched)};
    play(one, object.rows, object.object);
  }

  ObjectModels compare(const GivenObject& given) {
    ObjectModels object{.object = given.name, .rigid = !soft_index(given.name)};
    object.alone = std::ranges::count_if(given_, &GivenObject::touched) == 1;
    std::vector<Variant> variants = variants_of(given);
    play(variants, object.rows, given.name);
    object.reference = reference_for(given.name, object.rows.front().course);
    object.contact = first_contact(object.reference, result_.floor_N, result_.dt_s);
    find_depth(object);
    if (!object.rigid) {
      const auto proxy = std::ranges::find(variants, kProxyVariant, &Variant::name);
      const auto own = soft_index(given.name);
      play_matched(object, objects_[*own].own.proxy ? variants.front() : *proxy);
    }
    object.reference_felt = felt_of(object.reference, object, result_.floor_N, result_.dt_s);
    for (ModelRow& row : object.rows) {
      if (row.left_out.empty()) row.felt = felt_of(row.course, object, result_.floor_N, result_.dt_s);
    }
    return object;
  }

  const ModelsOptions& options_;
  Scene scene_;
  SearchProgress progress_;
  Step step_;
  std::vector<TunableObject> objects_;
  Motion motion_;
  std::vector<GivenObject> given_;
  ModelsInScene result_;
};

}  // namespace

ModelsInScene models_in_scene(const Scene& as_read, const ModelsOptions& options) {
  return ModelsRun(as_read, options).run();
}

}  // namespace hybrid
