// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/build/choose_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "hybrid/feel/just_noticeable.h"

namespace hybrid {
namespace {

// From about this stiffness on, a hand perceives a surface as rigid: 153 to 415 N/cm in Tan, Srinivasan,
// Eberman & Cheng, "Human factors for the design of force-reflecting haptic interfaces" (1994).
constexpr double kRigidToAHand_N_per_m = 25e3;
// Force limit that is assumed for a device without a limit. It is that of the largest known device.
constexpr double kStrongForce_N = 37.5;

struct Stiffness {
  double N_per_m = std::numeric_limits<double>::infinity();
  std::string material;
};

// The softest material of the object decides, because the choice must hold everywhere on it.
Stiffness softest(const Scene& scene, const SoftDescription& soft, double force_N) {
  std::vector<std::string> names{soft.material};
  for (const auto& [label, name] : soft.materials) names.push_back(name);
  Stiffness least;
  for (const std::string& name : names) {
    const Material material = name.empty() ? Material{} : scene.materials.at(name);
    const double k = secant_stiffness_N_per_m(material, scene.tool, force_N);
    if (k < least.N_per_m) least = {k, name.empty() ? "the default material" : "\"" + name + "\""};
  }
  return least;
}

struct Choice {
  bool proxy = false;
  std::string reason;
};

// The felt stiffness is that of tissue and coupling in series. Two bounds limit it: the greatest stiffness
// that the device can render, and the stiffness from which on a hand perceives a surface as rigid. A rigid
// surface is felt with the stiffness of the coupling, within the bounds. If the two felt stiffnesses differ
// by less than a just noticeable difference, voxels are not needed.
Choice choose(const Scene& scene, const SoftDescription& soft) {
  if (scene.tool.shape == Tool::Shape::punch) return {false, "a punch is felt by voxels alone"};
  const device::DeviceLimits limits = scene_limits(scene);
  const bool limited =
      scene.max_force_given || (limits.max_force_N > 0.0 && std::isfinite(limits.max_force_N));
  const double force_N = limited ? greatest_force_N(scene) : kStrongForce_N;
  double most = kRigidToAHand_N_per_m;
  if (limits.max_stiffness_N_per_m > 0.0) most = std::min(most, limits.max_stiffness_N_per_m);
  const Stiffness least = softest(scene, soft, force_N);
  const double coupling = scene.tool.stiffness_N_per_m;
  const double as_rigid = std::min(coupling, most);
  const double as_voxels = std::min(1.0 / (1.0 / coupling + 1.0 / least.N_per_m), most);
  const double share = 1.0 - as_voxels / as_rigid;
  Choice choice{.proxy = share <= kJndShare, .reason = {}};
  choice.reason = fmt::format(
      "{} answers {:.3g} N of this tool with {:.3g} N/mm, felt as {:.3g} N/mm where rigid is {:.3g}: {:.2g} "
      "% "
      "less, and a hand tells {:.0f} %",
      least.material, force_N, 1e-3 * least.N_per_m, 1e-3 * as_voxels, 1e-3 * as_rigid, 100.0 * share,
      100.0 * kJndShare);
  return choice;
}

}  // namespace

double secant_stiffness_N_per_m(const Material& material, const Tool& tool, double force_N) {
  const double modulus = material.young_Pa / (1.0 - material.poisson * material.poisson);
  if (tool.shape == Tool::Shape::punch) return 2.0 * tool.radius_m * modulus;
  const double depth = std::pow(force_N / (4.0 / 3.0 * modulus * std::sqrt(tool.radius_m)), 2.0 / 3.0);
  return force_N / depth;
}

RigidDescription as_rigid(const SoftDescription& soft) {
  RigidDescription rigid{.name = soft.name,
                         .source = {},
                         .pose = soft.pose,
                         .place = soft.place,
                         .source_place = soft.source_place};
  if (const auto* formula = std::get_if<voxel::Formula>(&soft.source)) {
    if (formula->shape == voxel::Formula::Shape::ball) {
      rigid.source = BallPrimitive{0.5 * formula->size_m.x};
    } else {
      rigid.source = BoxPrimitive{formula->size_m};
    }
  } else if (const auto* mesh = std::get_if<ClosedMeshSource>(&soft.source)) {
    rigid.source = mesh->mesh;
  } else {
    const auto& volume = std::get<VolumeSource>(soft.source);
    VolumeSurfaceSource surface{.file = volume.file,
                                .rules = volume.rules,
                                .spacing_m = std::nullopt,
                                .cuts = {},
                                .unit_m = volume.unit_m};
    if (volume.spacing_m) surface.spacing_m = volume.spacing_m->x;
    surface.largest = volume.largest;
    rigid.source = surface;
  }
  return rigid;
}

void choose_models(Scene& scene) {
  std::vector<SoftDescription> soft;
  for (SoftDescription& d : scene.soft) {
    Choice choice{.proxy = d.model == SoftModel::proxy, .reason = "the scene says so"};
    if (d.model == SoftModel::automatic) choice = choose(scene, d);
    if (d.model != SoftModel::voxels)
      scene.model_notes.push_back(
          {d.name, fmt::format("felt through {}: {}", choice.proxy ? "the proxy, as rigid" : "its voxels",
                               choice.reason)});
    if (choice.proxy) {
      scene.rigid.push_back(as_rigid(d));
    } else {
      soft.push_back(std::move(d));
    }
  }
  scene.soft = std::move(soft);
}

double greatest_force_N(const Scene& scene) noexcept {
  const double own = scene_limits(scene).max_force_N;
  if (!(own > 0.0) || !std::isfinite(own)) return scene.safety.max_force_N;
  return scene.max_force_given ? std::min(scene.safety.max_force_N, own) : own;
}

}  // namespace hybrid
