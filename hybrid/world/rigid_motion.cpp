// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/world/rigid_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>
#include <limits>
#include <stdexcept>
#include <utility>
#include <variant>

namespace hybrid {
namespace {

// Mass properties at a density of 1 kg/m³, if the shape has a volume.
struct EvenlyFilled {
  const polygon::TriangleMesh& shape;
  bool closed;

  std::optional<MassProperties> operator()(const BallPrimitive& s) const {
    return mass_of_ball(s.radius_m, 1.0);
  }
  std::optional<MassProperties> operator()(const BoxPrimitive& s) const { return mass_of_box(s.size_m, 1.0); }
  std::optional<MassProperties> operator()(const CapsulePrimitive& s) const {
    return mass_of_capsule(s.radius_m, s.length_m, 1.0);
  }
  std::optional<MassProperties> operator()(const PlanePrimitive& /*sheet*/) const { return std::nullopt; }
  std::optional<MassProperties> operator()(const MeshSource& /*mesh*/) const { return of_shape(); }
  std::optional<MassProperties> operator()(const VolumeSurfaceSource& /*mesh*/) const { return of_shape(); }

 private:
  [[nodiscard]] std::optional<MassProperties> of_shape() const {
    if (!closed) return std::nullopt;
    return mass_of_mesh(shape, 1.0);
  }
};

FreeBody free_body_of(const RigidDescription& description, const FreeMotion& motion,
                      const polygon::TriangleMesh& shape, bool closed) {
  FreeBody body{.mass = {},
                .drag_N_s_per_m = motion.drag_N_s_per_m,
                .angular_drag_N_m_s = motion.angular_drag_N_m_s,
                .gravity_m_per_s2 = motion.gravity_m_per_s2};
  const bool all_said = motion.mass_kg && motion.inertia_kg_m2;
  const std::optional<MassProperties> even =
      all_said && motion.centre_m ? std::nullopt
                                  : std::visit(EvenlyFilled{shape, closed}, description.source);
  if (!all_said && !even) {
    throw std::runtime_error(
        "it moves freely, and its surface encloses no volume to have a mass and an inertia; say both mass "
        "and "
        "inertia, or close the mesh (repair = true stitches it and closes small holes)");
  }
  if (even)
    body.mass = with_mass(
        *even, motion.density_kg_per_m3 ? even->mass_kg * *motion.density_kg_per_m3 : *motion.mass_kg);
  if (motion.mass_kg) body.mass.mass_kg = *motion.mass_kg;
  if (motion.inertia_kg_m2) {
    const glm::dvec3& i = *motion.inertia_kg_m2;
    body.mass.inertia_kg_m2 = {i.x, 0.0, 0.0, 0.0, i.y, 0.0, 0.0, 0.0, i.z};
  }
  if (motion.centre_m) {
    // Moments of inertia from the scene are about the given centre. Computed moments are moved there
    // (Steiner's theorem).
    if (!motion.inertia_kg_m2) {
      const glm::dvec3 d = *motion.centre_m - body.mass.centre_m;
      body.mass.inertia_kg_m2 += body.mass.mass_kg * (glm::dmat3(glm::dot(d, d)) - glm::outerProduct(d, d));
    }
    body.mass.centre_m = *motion.centre_m;
  }
  const glm::dmat3& i = body.mass.inertia_kg_m2;
  const bool usable = body.mass.mass_kg > 0.0 && std::isfinite(body.mass.mass_kg) &&
                      possible_inertia({i[0][0], i[1][1], i[2][2]});
  if (!usable) {
    throw std::runtime_error(fmt::format(
        "its mass would be {:.3g} kg and its moments of inertia {:.3g}, {:.3g} and {:.3g} kg m², which "
        "no body can have; correct mass, density or inertia",
        body.mass.mass_kg, i[0][0], i[1][1], i[2][2]));
  }
  return body;
}

}  // namespace

RigidMotion::RigidMotion(const RigidDescription& description, const Pose& start,
                         const polygon::TriangleMesh& shape, bool closed)
    : start_(start) {
  start_.rotation = glm::normalize(start.rotation);
  glm::dvec3 low(1e300), high(-1e300);
  for (const glm::dvec3& v : shape.vertices) {
    low = glm::min(low, v);
    high = glm::max(high, v);
  }
  if (!shape.vertices.empty()) middle_in_body_ = 0.5 * (low + high);
  for (const glm::dvec3& v : shape.vertices) lever_m_ = std::max(lever_m_, glm::distance(v, middle_in_body_));
  if (const auto* kinematic = std::get_if<PathMotion>(&description.motion)) {
    kind_ = Kind::path;
    if (kinematic->path) path_ = device::make_path(*kinematic->path);
    spin_ = kinematic->spin;
  } else if (const auto* free = std::get_if<FreeMotion>(&description.motion)) {
    kind_ = Kind::free;
    free_ = free_body_of(description, *free, shape, closed);
  }
}

Pose RigidMotion::pose_at(double t_s) const noexcept {
  Pose pose = start_;
  if (kind_ != Kind::path || !(t_s > 0.0)) return pose;
  if (spin_) {
    const double angle = spin_->amplitude_rad != 0.0
                             ? spin_->amplitude_rad *
                                   std::sin(glm::two_pi<double>() * std::fmod(spin_->frequency_hz * t_s, 1.0))
                             : std::fmod(spin_->rate_rad_per_s * t_s, glm::two_pi<double>());
    const glm::dvec3 axis = std::sin(0.5 * angle) * spin_->axis;
    const glm::dquat turn(std::cos(0.5 * angle), axis.x, axis.y, axis.z);
    pose.rotation = glm::normalize(turn * start_.rotation);
    pose.position_m = spin_->about_m + turn * (start_.position_m - spin_->about_m);
  }
  if (path_) pose.position_m += path_->position(t_s) - path_->position(0.0);
  return pose;
}

double RigidMotion::duration_s() const noexcept {
  if (kind_ != Kind::path) return 0.0;
  if (spin_) return std::numeric_limits<double>::infinity();
  return path_ ? path_->duration_s() : 0.0;
}

double RigidMotion::displacement_bound(const Pose& before, const Pose& after) const noexcept {
  const glm::dvec3 moved = after.position_m - before.position_m + after.rotation * middle_in_body_ -
                           before.rotation * middle_in_body_;
  // A point at the end of the lever moves along a chord of 2 sin(θ/2) lever. sin(θ/2) is the length of the
  // vector part of the relative rotation.
  const glm::dquat between = glm::conjugate(before.rotation) * after.rotation;
  const double half_sine = glm::length(glm::dvec3(between.x, between.y, between.z));
  return (glm::length(moved) + 2.0 * half_sine * lever_m_) * (1.0 + 1e-12);
}

}  // namespace hybrid
