// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tune/setting.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <set>

#include "hybrid/base/number_text.h"
#include "hybrid/build/choose_model.h"
#include "hybrid/compare/compare.h"

namespace hybrid {
namespace {

// Least number of voxels along an edge of a formula, so that one layer can be held and one can move.
constexpr double kFewestVoxels = 2.0;

double rounded(double value, int digits = kSpacingDigits) {
  return std::strtod(with_digits(value, digits).c_str(), nullptr);
}
glm::dvec3 rounded(const glm::dvec3& v) {
  return {rounded(v.x), rounded(v.y), rounded(v.z)};
}

std::vector<const Material*> materials_of(const Scene& scene, const SoftDescription& soft) {
  static const Material kDefault;
  std::vector<const Material*> out;
  const auto add = [&](const std::string& name) {
    const auto found = scene.materials.find(name);
    out.push_back(found == scene.materials.end() ? &kDefault : &found->second);
  };
  add(soft.material);
  for (const auto& [label, name] : soft.materials) add(name);
  return out;
}

bool yields(const Scene& scene, const SoftDescription& soft) {
  return std::ranges::any_of(materials_of(scene, soft),
                             [](const Material* m) { return std::isfinite(m->yield); });
}

// The voxels' spacing in a file before resampling, in the scene's unit.
glm::dvec3 file_spacing(const Scene& scene, const VolumeSource& volume) {
  return rounded(voxel::read_volume_header(volume.file, volume.unit_m).spacing_m / scene.unit_m);
}

void set_spacing_m(SoftSource& source, const glm::dvec3& spacing_m) {
  if (auto* volume = std::get_if<VolumeSource>(&source)) {
    volume->spacing_m = spacing_m;
  } else if (auto* mesh = std::get_if<ClosedMeshSource>(&source)) {
    mesh->spacing_m = spacing_m;
  } else {
    std::get<voxel::Formula>(source).spacing_m = spacing_m;
  }
}

void find_spacing(const Scene& scene, const SoftDescription& soft, TunableObject& object) {
  if (const auto* volume = std::get_if<VolumeSource>(&soft.source)) {
    object.finest = file_spacing(scene, *volume);
    if (volume->spacing_m) object.own.spacing = rounded(*volume->spacing_m / scene.unit_m);
  } else if (const auto* mesh = std::get_if<ClosedMeshSource>(&soft.source)) {
    object.own.spacing = rounded(mesh->spacing_m / scene.unit_m);
  } else {
    const auto& formula = std::get<voxel::Formula>(soft.source);
    object.own.spacing = rounded(formula.spacing_m / scene.unit_m);
    const bool ball = formula.shape == voxel::Formula::Shape::ball;
    object.snap_to = (ball ? glm::dvec3(formula.size_m.x) : formula.size_m) / scene.unit_m;
  }
}

void find_energy(const Scene& scene, const SoftDescription& soft, TunableObject& object) {
  const auto materials = materials_of(scene, soft);
  object.own.energy = soft.energy;
  if (yields(scene, soft)) {
    object.note = "energy stays six-link, as a material yields";
  } else if (std::ranges::all_of(materials, [](const Material* m) { return m->energy.has_value(); })) {
    object.note = "energy stays as its materials say";
  } else {
    object.other_energy = true;
  }
}

ObjectSetting* find(Setting& setting, const std::string& object) {
  const auto found = std::ranges::find(setting.objects, object, &ObjectSetting::object);
  return found == setting.objects.end() ? nullptr : &*found;
}

std::string object_in_words(const ObjectSetting& setting, double unit_m) {
  if (setting.proxy) return "as rigid";
  const glm::dvec3& s = setting.spacing;
  const double mm = 1e3 * unit_m;
  std::string text;
  if (s == glm::dvec3(0.0)) {
    text = "file's spacing";
  } else if (s.x == s.y && s.y == s.z) {
    text = with_digits(s.x * mm, 4) + " mm";
  } else if (std::max({s.x, s.y, s.z}) < 1.25 * std::min({s.x, s.y, s.z})) {
    text = "about " + with_digits(std::cbrt(s.x * s.y * s.z) * mm, 3) + " mm";
  } else {
    text = fmt::format("{} x {} x {} mm", with_digits(s.x * mm, 3), with_digits(s.y * mm, 3),
                       with_digits(s.z * mm, 3));
  }
  text += std::string(" ") + energy_name(setting.energy);
  if (setting.work < 1.0) text += ", work " + with_digits(setting.work, 2);
  if (setting.patch != kPatchMargin) text += fmt::format(", patch {}", setting.patch);
  return text;
}

}  // namespace

const char* energy_name(Energy energy) {
  return energy == Energy::trilinear ? "trilinear" : "six-link";
}

std::string spacing_text(const glm::dvec3& spacing) {
  const auto number = [](double v) { return with_digits(v, kSpacingDigits); };
  if (spacing.x == spacing.y && spacing.y == spacing.z) return number(spacing.x);
  return fmt::format("[{}, {}, {}]", number(spacing.x), number(spacing.y), number(spacing.z));
}

std::string coupling_text(double stiffness_N_per_m) {
  return with_digits(stiffness_N_per_m, kCouplingDigits);
}

std::vector<TunableObject> tunable_objects(const Scene& as_read) {
  Scene decided = as_read;
  choose_models(decided);
  std::vector<TunableObject> objects;
  for (const SoftDescription& soft : as_read.soft) {
    if (soft.model == SoftModel::proxy) continue;
    TunableObject object;
    object.own.object = soft.name;
    object.own.proxy = std::ranges::none_of(
        decided.soft, [&](const SoftDescription& left) { return left.name == soft.name; });
    object.own.work = soft.work;
    object.own.patch = soft.patch;
    object.model_written = soft.model != SoftModel::voxels;
    object.other_model = as_read.tool.shape != Tool::Shape::punch;
    find_spacing(as_read, soft, object);
    find_energy(as_read, soft, object);
    objects.push_back(std::move(object));
  }
  return objects;
}

Setting own_setting(const std::vector<TunableObject>& objects) {
  Setting setting;
  for (const TunableObject& object : objects) setting.objects.push_back(object.own);
  return setting;
}

Setting with_coupling(Setting setting, double stiffness_N_per_m) {
  setting.coupling_N_per_m = rounded(stiffness_N_per_m, kCouplingDigits);
  return setting;
}

ObjectSetting scaled(const TunableObject& object, double scale) {
  ObjectSetting setting = object.own;
  if (scale == 1.0) return setting;
  const bool none = object.own.spacing == glm::dvec3(0.0);
  const glm::dvec3 own = none ? object.finest : object.own.spacing;
  for (int d = 0; d < 3; ++d) {
    double spacing = std::max(own[d] * scale, object.finest[d]);
    if (object.snap_to[d] > 0.0) {
      const double voxels = std::max(std::round(object.snap_to[d] / spacing), kFewestVoxels);
      spacing = object.snap_to[d] / voxels;
    }
    setting.spacing[d] = rounded(spacing);
  }
  if (none && setting.spacing == object.finest) setting.spacing = glm::dvec3(0.0);
  return setting;
}

double scale_of(const TunableObject& object, const ObjectSetting& setting) {
  const auto mean = [&](const glm::dvec3& spacing) {
    const glm::dvec3& s = spacing == glm::dvec3(0.0) ? object.finest : spacing;
    return std::cbrt(s.x * s.y * s.z);
  };
  return mean(setting.spacing) / mean(object.own.spacing);
}

Scene with_setting(const Scene& as_read, const Setting& setting) {
  Scene scene = as_read;
  Setting values = setting;
  for (SoftDescription& soft : scene.soft) {
    const ObjectSetting* object = find(values, soft.name);
    if (object == nullptr) continue;
    soft.model = object->proxy ? SoftModel::proxy : SoftModel::voxels;
    soft.energy = object->energy;
    soft.work = object->work;
    soft.patch = object->patch;
    if (object->spacing != glm::dvec3(0.0)) set_spacing_m(soft.source, object->spacing * scene.unit_m);
  }
  if (setting.coupling_N_per_m) scene.tool.stiffness_N_per_m = *setting.coupling_N_per_m;
  choose_models(scene);
  return on_ideal_device(scene);
}

Scene as_reference(const Scene& as_read, const Setting& setting, int split) {
  Scene exact = as_read;
  Setting voxels{setting.objects};
  std::set<std::string> own_energy;
  for (SoftDescription& soft : exact.soft) {
    ObjectSetting* object = find(voxels, soft.name);
    if (object == nullptr) continue;
    object->proxy = false;
    object->work = 1.0;
    object->patch = std::max(object->patch, kPatchMargin);
    soft.thinning.reset();
    soft.split = split;
    if (yields(exact, soft)) continue;
    object->energy = Energy::trilinear;
    own_energy.insert(soft.material);
    for (const auto& [label, name] : soft.materials) own_energy.insert(name);
  }
  for (auto& [name, material] : exact.materials) {
    if (own_energy.contains(name) && !std::isfinite(material.yield)) material.energy.reset();
  }
  return with_setting(exact, voxels);
}

std::string in_words(const Setting& setting, double unit_m) {
  std::vector<std::string> parts;
  for (const ObjectSetting& object : setting.objects) parts.push_back(object_in_words(object, unit_m));
  if (parts.empty()) return "nothing to tune";
  std::string text;
  if (std::ranges::all_of(parts, [&](const std::string& part) { return part == parts.front(); })) {
    text = parts.front();
  } else {
    for (std::size_t n = 0; n < parts.size(); ++n)
      text += (n > 0 ? ", " : "") + setting.objects[n].object + " " + parts[n];
  }
  if (setting.coupling_N_per_m) text += fmt::format(", {} N/m", coupling_text(*setting.coupling_N_per_m));
  return text;
}

std::string as_toml(const Setting& setting) {
  std::string text;
  for (const ObjectSetting& object : setting.objects) {
    text += fmt::format("# of the [[soft]] \"{}\"\n", object.object);
    if (object.proxy) {
      text += "model = \"proxy\"\n";
      continue;
    }
    if (object.spacing != glm::dvec3(0.0))
      text += fmt::format("spacing = {} # lengths in the scene's unit\n", spacing_text(object.spacing));
    text += fmt::format("energy = \"{}\"\nmodel = \"voxels\"\n", energy_name(object.energy));
    if (object.work != 1.0) text += fmt::format("work = {}\n", with_digits(object.work, kSpacingDigits));
    if (object.patch != kPatchMargin) text += fmt::format("patch = {}\n", object.patch);
  }
  if (setting.coupling_N_per_m)
    text += fmt::format("# of [tool]\nstiffness = {} # N/m\n", coupling_text(*setting.coupling_N_per_m));
  return text;
}

}  // namespace hybrid
