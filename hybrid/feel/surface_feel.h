// SPDX-License-Identifier: GPL-3.0-or-later
// The feel of a rigid surface beyond its shape: friction, damping, shading, texture. All are functions of the
// tick, and each is off unless the scene enables it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <span>

namespace hybrid {

class HeightTexture;

struct SurfaceFeel {  // the feel of one rigid object
  double damping_N_s_per_m = 0.0;
  double static_friction = 0.0, dynamic_friction = 0.0;  // 0 <= dynamic <= static
  bool shading = false;
  std::shared_ptr<const HeightTexture> texture{};
  double texture_share = 1.0;      // factor on the texture's height
  double stiffness_N_per_m = 0.0;  // of the coupling in contact with this object; 0: the tool's

  [[nodiscard]] bool has_friction() const noexcept { return static_friction > 0.0; }
  [[nodiscard]] bool any() const noexcept {
    return damping_N_s_per_m > 0.0 || has_friction() || shading || texture != nullptr;
  }
};

// The feel of a contact with several objects. Each object's weight is its share of the contact force.
struct FeltSurface {
  const SurfaceFeel* feel = nullptr;
  double force_N = 0.0;  // force of this object on the proxy, >= 0
};
struct MixedFeel {
  double damping_N_s_per_m = 0.0, static_friction = 0.0, dynamic_friction = 0.0;
};
MixedFeel mix_feel(std::span<const FeltSurface> surfaces) noexcept;

// ---- Coulomb friction: the friction cone acts on the proxy, not on the force ----
// Ruspini, Kolarov & Khatib 1997; Harwin & Melder 2002.

struct FrictionStep {
  glm::dvec3 target{0.0};  // new target of the proxy, instead of the frictionless one
  bool sliding = false;    // must be passed to the next tick
  double normal_N = 0.0,
         tangential_N =
             0.0;  // parts of the pull on the proxy before it moves; normal_N > 0: the proxy presses
};

// The proxy must be feasible, and must have been carried along with the surface since the last tick. The pull
// on the proxy is f = A (target − proxy), and the surface has the unit normal `normal`. The proxy stays while
// the pull is within the friction cone. A proxy at rest has the static cone. A sliding proxy has the dynamic
// cone, because only there it comes to rest by itself.
//
// If the pull is outside the cone, the proxy slides: the target is moved back by A⁻¹ μN û. Here û is the
// pull's tangential direction, and N is the normal force after the slide (for A = K·1 equal to that before
// the slide). At the end of the slide the tangential force is exactly μN. If the pull is on the dynamic cone
// the proxy does not move, so the force is continuous there.
//
// On a plane the step ends between the proxy and the frictionless minimum. So ½ (target − q)ᵀ A (target − q)
// never grows: the work of the hand is stored or dissipated. On a curved surface the step can be longer.
// friction_dissipates() returns whether the step lost energy. If it did not, the proxy must stay.
//
// If the proxy slid in one pass of a tick, pass `sliding` = true in the later passes and in the next tick.
FrictionStep friction_target(const glm::dvec3& proxy, const glm::dvec3& target, const glm::dmat3& metric,
                             const glm::dvec3& normal, double static_friction, double dynamic_friction,
                             bool sliding) noexcept;

bool friction_dissipates(const glm::dvec3& before, const glm::dvec3& after, const glm::dvec3& target,
                         const glm::dmat3& metric) noexcept;

// ---- damping along the normal (thesis, eq 1 and 2) ----

// Growth rate of a depth, from its values at the ticks. A difference over one tick of 1 ms would turn an
// encoder step of 0.03 mm into 30 mm/s. A fixed low-pass filter would be late in an impact, when damping is
// needed. So the window is adaptive (Janabi-Sharifi, Hayward & Chen 2000, end-fit first order). It is the
// longest one in which every value is within one encoder step of the line through its ends. In an impact this
// is one tick, and for a tool at rest kMaxValues values. The rate is exact for a depth that is linear in
// time, and otherwise late by half the window. With noise 0 it is the difference over one tick.
class DepthRate {
 public:
  // Adds a value and returns the rate (m/s); 0 for the first value. `noise_m`: encoder step.
  double add(double depth_m, double dt_s, double noise_m) noexcept;
  void clear() noexcept { count_ = 0; }

 private:
  static constexpr std::size_t kMaxValues = 16;         // number of values kept
  std::array<double, kMaxValues> depth_m_{}, age_s_{};  // [0] is the newest; its age is 0
  std::size_t count_ = 0;
};

// State of a contact's damping.
struct DampingState {
  DepthRate rate;
  double depth_m = 0.0;
  double wanted_N = 0.0;     // damping force of the last tick, whether or not it was applied
  double balance_J = 0.0;    // recent work of the hand on the damper
  double earned_J = 0.0;     // work since damping was suspended, as if damping were applied
  double resume_at_J = 0.0;  // value of earned_J at which damping resumes
  bool touching = false, felt = true;
};

// The damping force B·rate. It is at least −normal_N, the spring's force, so that the whole normal force
// never pulls the tool in. It resists motion in both directions. Sampled damping is not passive by itself
// (Colgate & Schenkel 1997). So the work of the hand on the damper is accounted, with an exponential memory
// of kDampingMemory_s. If the damper has returned more energy than it received, it is suspended until it
// would have received twice the deficit. In each further suspension this amount is at least twice that of the
// suspension before. So the damper cannot feed an oscillation, however long the contact lasts. The next
// contact starts with an empty account.
inline constexpr double kDampingMemory_s = 0.05;
// With `account` false, damping is always applied: plain sampled damping.
double damping_force(DampingState& state, double normal_N, double depth_m, double damping_N_s_per_m,
                     double dt_s, double noise_m, bool account = true) noexcept;
// Call in every tick without contact.
inline void end_damping(DampingState& state) noexcept {
  state = DampingState{};
}

// ---- force shading (thesis, Fig 5; Morgenbesser & Srinivasan 1996) ----

// Limit for the angle between a shaded normal and the surface's own normal. A larger angle is reduced to the
// limit. At the silhouette of a coarse mesh, or over a true sharp edge, the force must still push out.
inline constexpr double kLeastShadedCosine = 0.5;  // 60°

// Turns `shaded` towards `normal` until shaded·normal >= least_cosine. Both should be unit vectors. Returns
// `normal` if `shaded` is not a unit vector or is opposite to it. Otherwise the result is continuous.
glm::dvec3 limit_shaded_normal(const glm::dvec3& shaded, const glm::dvec3& normal,
                               double least_cosine = kLeastShadedCosine) noexcept;

// The metric M in which the proxy moves freely along the pull of the shaded normals, and hardly across it.
// The proxy moves to the q on the true planes that minimises (q − goal)ᵀ M (q − goal). There lines from the
// goal along the shaded normals meet the surface, so A (goal − q) is in the span of these normals. Repeat
// with the shaded normals at q until q stays. Each pass reduces the distance by the factor depth / (tool
// radius + radius of curvature that the normals suggest). The factor is below 1 if the depth is below that
// sum. At most three normals count. Returns `metric` if there are none.
glm::dmat3 shading_metric(const glm::dmat3& metric, std::span<const glm::dvec3> shaded_normals) noexcept;

}  // namespace hybrid
