// SPDX-License-Identifier: GPL-3.0-or-later
// The feel of a rigid surface beyond its shape: friction, damping, shading, texture. Pure functions of the
// tick; each is off unless the scene enables it.
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

struct SurfaceFeel {  // of one rigid object
  double damping_N_s_per_m = 0.0;
  double static_friction = 0.0, dynamic_friction = 0.0;  // 0 <= dynamic <= static
  bool shading = false;
  std::shared_ptr<const HeightTexture> texture{};
  double texture_share = 1.0;  // of the texture's own height

  [[nodiscard]] bool has_friction() const noexcept { return static_friction > 0.0; }
  [[nodiscard]] bool any() const noexcept {
    return damping_N_s_per_m > 0.0 || has_friction() || shading || texture != nullptr;
  }
};

// The feel of a contact with several objects: each is weighted by its share of the contact force.
struct FeltSurface {
  const SurfaceFeel* feel = nullptr;
  double force_N = 0.0;  // of this object on the proxy, >= 0
};
struct MixedFeel {
  double damping_N_s_per_m = 0.0, static_friction = 0.0, dynamic_friction = 0.0;
};
MixedFeel mix_feel(std::span<const FeltSurface> surfaces) noexcept;

// ---- Coulomb friction, with the cone on the proxy and not on the force ----
// Ruspini, Kolarov & Khatib 1997; Harwin & Melder 2002.

struct FrictionStep {
  glm::dvec3 target{0.0};  // new target of the proxy, instead of the frictionless one
  bool sliding = false;    // pass it to the next tick
  double normal_N = 0.0,
         tangential_N = 0.0;  // of the pull on the proxy before it moves; normal_N > 0: it presses
};

// The proxy is feasible, and was carried along with the surface since the last tick. It is pulled by f = A
// (target − proxy) against a surface with the unit normal `normal`. It stays while the pull is in the
// friction cone: the static cone if it was at rest, the dynamic cone if it was sliding, because only there
// does it come to rest by itself. Otherwise the target is moved back by the friction force, A⁻¹ μN û, with û
// the pull's tangential direction and N the normal force after the slide (for A = K·1 equal to that before).
// At the end of the slide the tangential force is exactly μN. The proxy does not move if the pull is on the
// dynamic cone, so that the force is continuous there.
//
// On a plane, ½ (target − q)ᵀ A (target − q) never grows by the step, which ends between the proxy and the
// frictionless minimum: the work of the hand is stored or lost. On a curved surface the way can be longer.
// `friction_dissipates` tells whether the step lost energy; if not, the proxy stays.
//
// A proxy that slid in one pass of a tick is passed to the later passes and to the next tick as sliding.
// tick, as sliding.
FrictionStep friction_target(const glm::dvec3& proxy, const glm::dvec3& target, const glm::dmat3& metric,
                             const glm::dvec3& normal, double static_friction, double dynamic_friction,
                             bool sliding) noexcept;

bool friction_dissipates(const glm::dvec3& before, const glm::dvec3& after, const glm::dvec3& target,
                         const glm::dmat3& metric) noexcept;

// ---- damping along the normal (thesis, eq 1 and 2) ----

// Rate of growth of a depth, from its values at the ticks. A difference over one tick of 1 ms turns an
// encoder step of 0.03 mm into 30 mm/s, and a fixed low-pass filter is late in an impact, when damping is
// wanted. The window is therefore adaptive (Janabi-Sharifi, Hayward & Chen 2000, end-fit first order): the
// longest one in which every value lies within one encoder step of the straight line through its ends. In an
// impact it is one tick, for a tool at rest kMaxValues ticks. Exact for a depth that is linear in time;
// otherwise late by half the window. With noise 0 it is the difference over one tick.
class DepthRate {
 public:
  // Returns the rate (m/s); 0 for the first value.
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
  double wanted_N = 0.0;     // of the last tick, whether or not it was applied
  double balance_J = 0.0;    // recent work of the hand on the damper
  double earned_J = 0.0;     // work since damping was suspended, had it been applied
  double resume_at_J = 0.0;  // work at which it resumes
  bool touching = false, felt = true;
};

// The damping force B·rate, bounded so that the whole normal force never pulls the tool in: at least
// −normal_N, the spring's force. It resists motion in both directions. Sampled damping is not passive by
// nature (Colgate & Schenkel 1997), so the work of the hand on the damper is accounted, with an exponential
// memory of kDampingMemory_s. If the damper has returned more than it received, it is suspended until it
// would have earned as much, and twice as much each time after. It therefore cannot feed an oscillation,
// however long the contact. The next contact starts with an empty account.
inline constexpr double kDampingMemory_s = 0.05;
// With `account` false damping is always applied, as plain sampled damping.
double damping_force(DampingState& state, double normal_N, double depth_m, double damping_N_s_per_m,
                     double dt_s, double noise_m, bool account = true) noexcept;
// Call in every tick without contact.
inline void end_damping(DampingState& state) noexcept {
  state = DampingState{};
}

// ---- force shading (thesis, Fig 5; Morgenbesser & Srinivasan 1996) ----

// A shaded normal further than this from the surface's own is turned back to this angle: at the silhouette of
// a coarse mesh, or over a true sharp edge, the force must still push out.
inline constexpr double kLeastShadedCosine = 0.5;  // 60°

// `shaded` turned towards `normal` (both unit) until shaded·normal >= least_cosine. Returns `normal` if
// `shaded` is not a unit vector or is opposite. Continuous except there.
glm::dvec3 limit_shaded_normal(const glm::dvec3& shaded, const glm::dvec3& normal,
                               double least_cosine = kLeastShadedCosine) noexcept;

// The metric in which the proxy moves freely along the pull of the shaded normals, and hardly beside it. The
// step to the minimum of (q − goal)ᵀ M (q − goal) on the true planes ends where lines from the goal along
// those normals meet the surface, so that A (goal − q) lies in their span. Repeat with the shaded normals at
// q until q stays: each pass reduces the distance by the factor depth / (radius of curvature that the normals
// suggest + tool radius), which is below 1 if the depth is below that radius. At most three normals count;
// returns `metric` if there are none.
glm::dmat3 shading_metric(const glm::dmat3& metric, std::span<const glm::dvec3> shaded_normals) noexcept;

}  // namespace hybrid
