// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/compare/closed_form.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace hybrid {
namespace {

// Signed depth of a point in a box of half size h about the origin, and the direction of the way out.
// Negative: outside.
Depth depth_in_box(const glm::dvec3& p, const glm::dvec3& h) {
  const glm::dvec3 beyond = glm::abs(p) - h;
  const glm::dvec3 outside = glm::max(beyond, glm::dvec3(0.0));
  const double distance = glm::length(outside);
  if (distance > 0.0) return {-distance, outside * glm::sign(p) / distance};
  int d = beyond.x > beyond.y ? 0 : 1;
  if (beyond.z > beyond[d]) d = 2;
  glm::dvec3 out(0.0);
  out[d] = p[d] >= 0.0 ? 1.0 : -1.0;
  return {-beyond[d], out};
}

// Force of the tissue at an indentation (m), without the coupling.
double tissue_force(const ClosedForm& form, const Tool& tool, double indentation) {
  const double modulus = form.young_Pa / (1.0 - form.poisson * form.poisson);
  if (tool.shape == Tool::Shape::punch) return 2.0 * tool.radius_m * modulus * indentation;
  const double curvature =
      1.0 / tool.radius_m + (form.shape == ClosedForm::Shape::ball ? 1.0 / form.half_size_m.x : 0.0);
  return 4.0 / 3.0 * modulus * std::sqrt(1.0 / curvature) * std::pow(indentation, 1.5);
}

}  // namespace

std::optional<ClosedForm> closed_form_of(const RigidDescription& rigid) {
  ClosedForm form{.pose = rigid.pose, .caveat = {}};
  if (rigid.feel.any()) form.caveat = "friction, damping, shading and texture left out";
  if (const auto* ball = std::get_if<BallPrimitive>(&rigid.source)) {
    form.half_size_m = glm::dvec3(ball->radius_m);
    return form;
  }
  if (const auto* box = std::get_if<BoxPrimitive>(&rigid.source)) {
    form.shape = ClosedForm::Shape::box;
    form.half_size_m = 0.5 * box->size_m;
    return form;
  }
  return std::nullopt;
}

std::optional<ClosedForm> closed_form_of(const Scene& scene, const SoftDescription& soft) {
  const auto* formula = std::get_if<voxel::Formula>(&soft.source);
  if (formula == nullptr) return std::nullopt;
  const auto material = scene.materials.find(soft.material);
  const Material m = material == scene.materials.end() ? Material{} : material->second;
  ClosedForm form{
      .pose = soft.pose,
      .half_size_m = 0.5 * formula->size_m,
      .young_Pa = m.young_Pa,
      .poisson = m.poisson,
      .caveat = "half-space: small strain, no chain limit, the object much larger than the contact"};
  form.shape =
      formula->shape == voxel::Formula::Shape::ball ? ClosedForm::Shape::ball : ClosedForm::Shape::box;
  if (!formula->layers.empty() || !formula->inclusions.empty())
    form.caveat += "; layers and inclusions left out";
  return form;
}

Depth depth_in(const ClosedForm& form, const Tool& tool, const glm::dvec3& device_m) {
  const glm::dvec3 p = glm::inverse(form.pose.rotation) * (device_m - form.pose.position_m);
  const bool punch = tool.shape == Tool::Shape::punch;
  Depth depth;
  if (form.shape == ClosedForm::Shape::ball) {
    const double distance = glm::length(p);
    depth = {form.half_size_m.x - distance, distance > 0.0 ? p / distance : glm::dvec3(0.0, 0.0, 1.0)};
  } else if (punch) {
    // The punch presses with its face, so its radius is not added.
    depth = {form.half_size_m.z - p.z, glm::dvec3(0.0, 0.0, 1.0)};
  } else {
    depth = depth_in_box(p, form.half_size_m);
  }
  if (!punch) depth.depth_m += tool.radius_m;
  depth.out = form.pose.rotation * depth.out;
  return depth;
}

double force_at(const ClosedForm& form, const Tool& tool, double depth_m) {
  if (depth_m <= 0.0) return 0.0;
  if (form.young_Pa == 0.0) return tool.stiffness_N_per_m * depth_m;
  // With the indentation the tissue's force grows and the coupling's falls, so bisection finds their balance.
  double low = 0.0, high = depth_m;
  for (int n = 0; n < 100; ++n) {
    const double middle = 0.5 * (low + high);
    (tissue_force(form, tool, middle) < tool.stiffness_N_per_m * (depth_m - middle) ? low : high) = middle;
  }
  return tissue_force(form, tool, 0.5 * (low + high));
}

const char* law_of(const ClosedForm& form, const Tool& tool) {
  if (form.young_Pa == 0.0) return "rigid closed form";
  return tool.shape == Tool::Shape::punch ? "flat punch" : "hertz";
}

}  // namespace hybrid
