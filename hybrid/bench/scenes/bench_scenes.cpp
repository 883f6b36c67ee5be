// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/bench/scenes/bench_scenes.h"

#include <fmt/format.h>

#include <algorithm>
#include <glm/common.hpp>

#include "device/loop/stop_signal.h"
#include "hybrid/models/variants.h"
#include "hybrid/session/report.h"
#include "hybrid/tune/play.h"

namespace hybrid::bench {
namespace {

constexpr const char* kVoxelByVoxel = "voxel by voxel";

glm::dvec3 extent_of(const RigidObject& object) {
  glm::dvec3 low(0.0), high(0.0);
  if (object.drawn == nullptr || object.drawn->vertices.empty()) return low;
  low = high = object.drawn->vertices.front();
  for (const glm::dvec3& v : object.drawn->vertices) {
    low = glm::min(low, v);
    high = glm::max(high, v);
  }
  return high - low;
}

bool same_materials_energy(const std::vector<TunableObject>& objects) {
  return std::ranges::none_of(objects, &TunableObject::other_energy);
}

// The scene with the same change in all soft objects that allow it. Sets `left_out` if none allows it.
Variant with_all(const Scene& as_read, const std::vector<TunableObject>& objects, const std::string& name,
                 const std::function<void(const TunableObject&, ObjectSetting&)>& change) {
  Variant variant{.name = name, .words = {}};
  Setting setting = own_setting(objects);
  for (std::size_t n = 0; n < objects.size(); ++n) change(objects[n], setting.objects[n]);
  if (setting == own_setting(objects))
    variant.left_out = "the scene has this model already, or cannot have it";
  variant.words = in_words(setting, as_read.unit_m);
  variant.scene = with_setting(as_read, setting);
  variant.setting = std::move(setting);
  return variant;
}

std::vector<Variant> soft_baselines(const Scene& as_read, const std::vector<TunableObject>& objects,
                                    const BuiltScene& built) {
  std::vector<Variant> variants;
  if (std::ranges::any_of(built.state->soft, [](const auto& o) { return o->uses_patches(); })) {
    Scene scene = as_read;
    for (SoftDescription& soft : scene.soft) soft.patches = false;
    const Setting own = own_setting(objects);
    variants.push_back(
        {.name = kVoxelByVoxel, .words = in_words(own, as_read.unit_m), .scene = with_setting(scene, own)});
  }
  for (const Energy energy : {Energy::six_link, Energy::trilinear}) {
    if (same_materials_energy(objects)) break;
    variants.push_back(with_all(as_read, objects, energy_name(energy),
                                [energy](const TunableObject& object, ObjectSetting& one) {
                                  one.proxy = false;
                                  if (object.other_energy) one.energy = energy;
                                }));
  }
  variants.push_back(with_all(
      as_read, objects, kProxyVariant,
      [](const TunableObject& object, ObjectSetting& one) { one.proxy = one.proxy || object.other_model; }));
  return variants;
}

// The scene as given, and its baselines. A scene without soft objects gets its first rigid object as voxels.
std::vector<Variant> variants_of(const Scene& as_read, const Progress& progress) {
  const std::vector<TunableObject> objects = tunable_objects(as_read);
  std::vector<Variant> variants{as_given(as_read, objects, {})};
  if (!objects.empty()) variants.front().words = in_words(own_setting(objects), as_read.unit_m);
  const BuiltScene built = build_scene(variants.front().scene, progress);
  if (!objects.empty()) {
    for (Variant& variant : soft_baselines(as_read, objects, built)) variants.push_back(std::move(variant));
  } else if (!as_read.rigid.empty() && !built.world->rigid.empty()) {
    variants.push_back(
        voxel_variant(as_read, as_read.rigid.front().name, extent_of(built.world->rigid.front())));
  }
  return variants;
}

// A row with the times of its repeats.
struct Timed {
  SceneRow row;
  ForceCourse course;
  std::vector<Percentiles> repeats;
};

ForceCourse course_of(const SessionResult& result) {
  ForceCourse course;
  for (const TraceRow& row : result.rows) {
    course.push_back({row.device_m, row.coupling_N, row.contacts != 0});
  }
  return course;
}

// The first session is compared with a slow run, and not timed.
void play(const Variant& variant, const Motion& motion, bool timed, const Progress& progress, Timed& to) {
  if (!to.row.left_out.empty()) return;
  try {
    BuiltScene built = build_scene(variant.scene, progress);
    const SceneSize size = size_of(built);
    SessionOptions options;
    options.seconds = static_cast<double>(motion.ticks) / variant.scene.rate_hz;
    options.keep_recording = false;
    options.keep_rows = !timed;
    options.measure_error = !timed;
    options.async_relaxation = true;
    options.path = motion.path;
    options.progress = progress;
    const SessionResult result = run_session(variant.scene, built, options);
    device::stop_if_asked();
    to.row.load_s = timed ? std::min(to.row.load_s, built.seconds) : built.seconds;
    if (timed) {
      to.repeats.push_back(result.tick_us.percentiles());
      return;
    }
    to.row.ticks = result.ticks;
    to.row.contact_ticks = result.contact_ticks;
    to.row.own_error = result.error;
    to.row.memory_bytes = size.memory_bytes;
    to.row.soft_voxels = size.soft_voxels;
    to.row.faults = fault_texts(built.state->faults);
    to.course = course_of(result);
  } catch (const device::StopAsked&) {
    throw;
  } catch (const std::exception& error) {
    if (variant.name == kAsGiven) throw;
    to.row.left_out = error.what();
  }
}

OverRepeats over(const std::vector<Percentiles>& repeats, double Percentiles::*which) {
  std::vector<double> values;
  values.reserve(repeats.size());
  for (const Percentiles& p : repeats) values.push_back(p.*which);
  std::ranges::sort(values);
  return {values[values.size() / 2], values.front(), values.back()};
}

void finish(Timed& timed, const Timed& given, double floor_N, double dt_s) {
  SceneRow& row = timed.row;
  if (!row.left_out.empty()) return;
  row.repeats = static_cast<int>(timed.repeats.size());
  row.p50_us = over(timed.repeats, &Percentiles::p50);
  row.p99_us = over(timed.repeats, &Percentiles::p99);
  row.p999_us = over(timed.repeats, &Percentiles::p999);
  row.max_us = over(timed.repeats, &Percentiles::max);
  std::vector<double> ratios;
  for (std::size_t n = 0; n < std::min(timed.repeats.size(), given.repeats.size()); ++n)
    ratios.push_back(timed.repeats[n].p99 / given.repeats[n].p99);
  std::ranges::sort(ratios);
  row.p99_ratio = ratios[ratios.size() / 2];
  row.sure = ratios.front() > 1.0 || ratios.back() < 1.0;
  row.from_given = felt_error(timed.course, given.course, floor_N, dt_s);
}

std::string name_of(const std::filesystem::path& file) {
  return file.filename() == "scene.toml" ? file.parent_path().filename().string() : file.stem().string();
}

std::vector<SceneRow> bench_scene(const std::filesystem::path& file, const ScenesBenchOptions& options) {
  const Scene as_read = read_scene(file);
  const std::string name = name_of(file);
  const auto say = [&](const std::string& words) {
    return [&options, text = name + ", " + words](const std::string& inner) {
      if (options.progress) options.progress(text + ": " + inner);
    };
  };
  const std::vector<Variant> variants = variants_of(as_read, say("as given"));
  const Motion motion = scene_motion(variants.front().scene);
  std::vector<Timed> rows;
  std::vector<std::size_t> order;
  for (const Variant& variant : variants) {
    order.push_back(rows.size());
    rows.emplace_back();
    rows.back().row.scene = name;
    rows.back().row.model = variant.name;
    rows.back().row.values = variant.words;
    rows.back().row.left_out = variant.left_out;
  }
  for (int repeat = 0; repeat <= options.repeats; ++repeat) {
    const std::string turn = fmt::format("session {} of {}", repeat + 1, options.repeats + 1);
    for (const std::size_t n : order)
      play(variants[n], motion, repeat > 0, say(variants[n].name + ", " + turn), rows[n]);
    std::ranges::reverse(order);
  }
  std::vector<SceneRow> done;
  for (Timed& timed : rows) {
    finish(timed, rows.front(), jnd_floor_N(as_read), 1.0 / as_read.rate_hz);
    done.push_back(timed.row);
    if (options.on_row) options.on_row(timed.row);
  }
  return done;
}

}  // namespace

bool noisy(const SceneRow& row) {
  return row.left_out.empty() && row.p99_us.most - row.p99_us.least > kNoisy * row.p99_us.median;
}

std::vector<SceneRow> bench_scenes(const ScenesBenchOptions& options) {
  std::vector<SceneRow> rows;
  for (const auto& file : options.scenes) {
    try {
      for (SceneRow& row : bench_scene(file, options)) rows.push_back(std::move(row));
    } catch (const device::StopAsked&) {
      throw;
    } catch (const std::exception& error) {
      if (options.scenes.size() == 1) throw;
      rows.push_back({.scene = name_of(file), .model = kAsGiven, .left_out = error.what()});
      if (options.on_row) options.on_row(rows.back());
    }
  }
  return rows;
}

std::vector<std::filesystem::path> shipped_scenes() {
  namespace fs = std::filesystem;
  std::error_code none;
  const fs::path folder = fs::read_symlink("/proc/self/exe", none).parent_path();
  for (const char* place : {"../share/hybrid/scenes", "../../scenes"}) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder / place, none)) {
      if (entry.path().extension() == ".toml") files.push_back(entry.path().lexically_normal());
    }
    std::ranges::sort(files);
    if (!files.empty()) return files;
  }
  return {};
}

}  // namespace hybrid::bench
