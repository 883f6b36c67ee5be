// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/models/variants.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "hybrid/base/number_text.h"
#include "hybrid/build/choose_model.h"
#include "hybrid/compare/compare.h"

namespace hybrid {
namespace {

constexpr std::array kCoarser{1.5, 2.0};  // factors on the spacing
// A rigid object as voxels. A contact should be four voxels wide. kMostVoxelsAlong bounds the number of
// voxels.
constexpr double kVoxelsPerRadius = 2.0;  // of the tool's radius
constexpr double kMostVoxelsAlong = 80.0;
constexpr double kFewestVoxelsAcross = 2.0;
constexpr const char* kHardMaterial = "as voxels: hard";  // a name that no scene is likely to have

Setting changed(const std::vector<TunableObject>& objects, std::size_t index, const ObjectSetting& one) {
  Setting setting = own_setting(objects);
  setting.objects[index] = one;
  return setting;
}

Variant soft_variant(const Scene& as_read, const std::vector<TunableObject>& objects, std::size_t index,
                     std::string name, const ObjectSetting& one) {
  Variant variant{.name = std::move(name), .words = in_words({{one}}, as_read.unit_m), .scene = {}};
  if (one == objects[index].own) {
    variant.left_out = "the scene has this model already";
    return variant;
  }
  variant.setting = changed(objects, index, one);
  variant.scene = with_setting(as_read, *variant.setting);
  return variant;
}

Variant energy_variant(const Scene& as_read, const std::vector<TunableObject>& objects, std::size_t index,
                       Energy energy) {
  const TunableObject& object = objects[index];
  ObjectSetting one = object.own;
  one.proxy = false;
  const bool fixed = !object.other_energy && energy != one.energy;
  one.energy = energy;
  Variant variant = soft_variant(as_read, objects, index, energy_name(energy), one);
  if (fixed) variant.left_out = object.note;
  return variant;
}

Variant coarser_variant(const Scene& as_read, const std::vector<TunableObject>& objects, std::size_t index,
                        double factor) {
  const TunableObject& object = objects[index];
  ObjectSetting one = object.own;
  one.proxy = false;
  one.spacing = scaled(object, factor).spacing;
  Variant variant =
      soft_variant(as_read, objects, index, fmt::format("spacing x {}", with_digits(factor, 2)), one);
  if (one.spacing == object.own.spacing) variant.left_out = "its edges allow no such spacing";
  return variant;
}

Variant proxy_variant(const Scene& as_read, const std::vector<TunableObject>& objects, std::size_t index) {
  ObjectSetting one = objects[index].own;
  one.proxy = true;
  if (objects[index].other_model) {
    Variant variant = soft_variant(as_read, objects, index, kProxyVariant, one);
    variant.words = fmt::format("rigid, {} N/m", with_digits(as_read.tool.stiffness_N_per_m, 4));
    return variant;
  }
  return {
      .name = kProxyVariant, .words = "rigid", .scene = {}, .left_out = "a punch is felt by voxels alone"};
}

SoftDescription* soft_named(Scene& scene, const std::string& name) {
  const auto found = std::ranges::find(scene.soft, name, &SoftDescription::name);
  return found == scene.soft.end() ? nullptr : &*found;
}

// Why the object has no voxels in this scene; empty if it may have them.
std::string why_no_voxels(const Scene& scene, const RigidDescription& rigid) {
  if (!std::holds_alternative<std::monostate>(rigid.motion)) return "it moves, which voxels do not";
  if (std::holds_alternative<PlanePrimitive>(rigid.source)) return "it is a sheet, which has no inside";
  if (std::holds_alternative<CapsulePrimitive>(rigid.source)) return "a capsule has no formula for voxels";
  const auto* surface = std::get_if<VolumeSurfaceSource>(&rigid.source);
  if (surface != nullptr && !surface->cuts.empty()) return "its cuts make it an open sheet";
  if (surface != nullptr && surface->grow_m != 0.0) return "its surface is grown, which voxels are not";
  const bool holds = std::ranges::any_of(
      scene.soft, [](const SoftDescription& soft) { return soft.anchors.rigid_within_m > 0.0; });
  return holds ? "it may hold tissue (rigid_within), which voxels would not" : "";
}

SoftSource voxel_source(const RigidDescription& rigid, double spacing_m) {
  if (const auto* ball = std::get_if<BallPrimitive>(&rigid.source)) {
    return voxel::Formula{.shape = voxel::Formula::Shape::ball,
                          .size_m = glm::dvec3(2.0 * ball->radius_m),
                          .spacing_m = glm::dvec3(spacing_m),
                          .layers = {},
                          .inclusions = {}};
  }
  if (const auto* box = std::get_if<BoxPrimitive>(&rigid.source)) {
    return voxel::Formula{
        .size_m = box->size_m, .spacing_m = glm::dvec3(spacing_m), .layers = {}, .inclusions = {}};
  }
  if (const auto* mesh = std::get_if<MeshSource>(&rigid.source))
    return ClosedMeshSource{*mesh, glm::dvec3(spacing_m)};
  const auto& surface = std::get<VolumeSurfaceSource>(rigid.source);
  return VolumeSource{.file = surface.file,
                      .rules = surface.rules,
                      .spacing_m = glm::dvec3(spacing_m),
                      .largest = surface.largest,
                      .unit_m = surface.unit_m};
}

SoftDescription as_soft_object(const RigidDescription& rigid, double spacing_m) {
  SoftDescription soft{.name = rigid.name,
                       .source = voxel_source(rigid, spacing_m),
                       .pose = rigid.pose,
                       .materials = {},
                       .material = kHardMaterial,
                       .anchors = {},
                       .place = rigid.place,
                       .source_place = rigid.source_place};
  return soft;
}

}  // namespace

Variant as_given(const Scene& as_read, const std::vector<TunableObject>& objects, const std::string& object) {
  Variant variant{.name = kAsGiven, .words = "rigid"};
  for (const TunableObject& o : objects) {
    if (o.own.object == object) variant.words = in_words({{o.own}}, as_read.unit_m);
  }
  variant.setting = own_setting(objects);
  variant.scene = with_setting(as_read, *variant.setting);
  return variant;
}

std::vector<Variant> soft_variants(const Scene& as_read, const std::vector<TunableObject>& objects,
                                   std::size_t index) {
  std::vector<Variant> variants;
  for (const Energy energy : {Energy::six_link, Energy::trilinear})
    variants.push_back(energy_variant(as_read, objects, index, energy));
  for (const double factor : kCoarser) variants.push_back(coarser_variant(as_read, objects, index, factor));
  Scene whole = as_read;
  SoftDescription* const soft = soft_named(whole, objects[index].own.object);
  if (soft != nullptr && soft->thinning && !objects[index].own.proxy) {
    soft->thinning.reset();
    variants.push_back({.name = "not thinned",
                        .words = in_words({{objects[index].own}}, as_read.unit_m),
                        .scene = with_setting(whole, own_setting(objects))});
  }
  variants.push_back(proxy_variant(as_read, objects, index));
  return variants;
}

Variant matched_variant(const Variant& proxy, double stiffness_N_per_m) {
  Variant matched = proxy;
  matched.name = kMatchedVariant;
  matched.setting = with_coupling(*proxy.setting, stiffness_N_per_m);
  matched.scene.tool.stiffness_N_per_m = *matched.setting->coupling_N_per_m;
  matched.words = fmt::format("rigid, {} N/m", coupling_text(*matched.setting->coupling_N_per_m));
  matched.left_out.clear();
  return matched;
}

Variant voxel_variant(const Scene& as_read, const std::string& name, const glm::dvec3& extent_m) {
  Variant variant{.name = kVoxelVariant, .words = {}, .scene = as_read};
  auto& all = variant.scene.rigid;
  const auto rigid = std::ranges::find(all, name, &RigidDescription::name);
  variant.left_out = why_no_voxels(as_read, *rigid);
  const double longest_m = std::max({extent_m.x, extent_m.y, extent_m.z});
  const double spacing_m = std::max(as_read.tool.radius_m / kVoxelsPerRadius, longest_m / kMostVoxelsAlong);
  variant.words =
      fmt::format("{} mm six-link, {:.0f} MPa", with_digits(1e3 * spacing_m, 3), 1e-6 * kVoxelYoung_Pa);
  const double thin_m = std::min({extent_m.x, extent_m.y, extent_m.z});
  if (variant.left_out.empty() && thin_m < kFewestVoxelsAcross * spacing_m) {
    variant.left_out = fmt::format("it is {} mm thin, less than two voxels of {} mm",
                                   with_digits(1e3 * thin_m, 3), with_digits(1e3 * spacing_m, 3));
  }
  if (!variant.left_out.empty()) return variant;
  variant.scene.materials[kHardMaterial] = Material{.young_Pa = kVoxelYoung_Pa, .place = {}};
  variant.scene.soft.push_back(as_soft_object(*rigid, spacing_m));
  all.erase(rigid);
  choose_models(variant.scene);
  variant.scene = on_ideal_device(variant.scene);
  return variant;
}

}  // namespace hybrid
