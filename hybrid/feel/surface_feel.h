// SPDX-License-Identifier: GPL-3.0-or-later
// What a rigid surface feels like beyond being there: friction, damping, shading, texture. Pure functions of
// the tick; each is off unless the scene asks for it.
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

  [[nodiscard]] bool has_friction() const noexcept { return static_friction > 0.0; }
  [[nodiscard]] bool any() const noexcept {
    return damping_N_s_per_m > 0.0 || has_friction() || shading || texture != nullptr;
  }
};

// What a contact with several objects feels like: each counts by its share of the force that presses.
struct FeltSurface {
  const SurfaceFeel* feel = nullptr;
  double force_N = 0.0;  // of this object on the proxy, >= 0
};
struct MixedFeel {
  double damping_N_s_per_m = 0.0, static_friction = 0.0, dynamic_friction = 0.0;
};
MixedFeel mix_feel(std::span<const FeltSurface> surfaces) noexcept;

// ---- Coulomb friction, the cone on the proxy and not on the force (Ruspini, Kolarov & Khatib 1997; Harwin &
// Melder 2002) --------------------------------------------------------------------------------------------

struct FrictionStep {
  glm::dvec3 target{0.0};  // where the proxy wants to go now, in place of the target without friction
  bool sliding = false;    // hand it to the next tick
  double normal_N = 0.0,
         tangential_N = 0.0;  // of the pull on the proxy before it moves; normal_N > 0 presses
};

// The proxy (feasible, and carried with the surface since the last tick) is pulled by f = A (target − proxy)
// against a surface with the unit normal `normal`. It stays where it is while the pull lies in the cone: the
// static one if it was at rest; the dynamic one if it was sliding, because only there does it come to rest by
// itself. Else the target is moved back by what friction holds, A⁻¹ μN û, with û the pull's tangential
// direction and N the pressure after the slide (with A = K·1 that before it is the same). So at the end of
// the slide the tangential force is exactly μN, and the proxy moves by nothing where the pull is on the
// dynamic cone: what is felt is continuous there.
//
// On a plane, ½ (target − q)ᵀ A (target − q) never grows by the step: the step ends between the proxy and the
// minimum without friction, so what the hand puts in is stored or lost. Where the surface curves the way can
// be longer; `friction_spends` says whether it spent energy, and a proxy for which it did not stays.
//
// In a tick of several passes a proxy that slid in one of them is told to the later ones, and to the next
// tick, as sliding.
FrictionStep friction_target(const glm::dvec3& proxy, const glm::dvec3& target, const glm::dmat3& metric,
                             const glm::dvec3& normal, double static_friction, double dynamic_friction,
                             bool sliding) noexcept;

bool friction_spends(const glm::dvec3& before, const glm::dvec3& after, const glm::dvec3& target,
                     const glm::dmat3& metric) noexcept;

// ---- damping along the normal (thesis, eq 1 and 2)
// ---------------------------------------------------------

// How fast a depth grows, from its values at the ticks. A difference over one tick of 1 ms turns an encoder
// step of 0.03 mm into 30 mm/s, and a fixed low-pass that hides this is late in an impact, where damping is
// wanted. So the window adapts (Janabi-Sharifi, Hayward & Chen 2000, end-fit first order): the longest one in
// which every value lies within one encoder step of the straight line through its ends. An impact takes a
// window of one tick, a tool at rest one of kMost. Exact for a depth that is linear in time; later by half
// the window otherwise. With noise 0 it is the difference over one tick.
class DepthRate {
 public:
  // Returns the rate (m/s); 0 for the first value.
  double add(double depth_m, double dt_s, double noise_m) noexcept;
  void clear() noexcept { count_ = 0; }

 private:
  static constexpr std::size_t kMost = 16;         // values held
  std::array<double, kMost> depth_m_{}, age_s_{};  // [0] is the newest; its age is 0
  std::size_t count_ = 0;
};

// What a contact remembers of its damping.
struct DampingState {
  DepthRate rate;
  double depth_m = 0.0;
  double wanted_N = 0.0;   // of the last tick, whether or not it was felt
  double balance_J = 0.0;  // what the hand has put into the damping, of late
  double earned_J = 0.0;   // and would have since it was left out,
  double toll_J = 0.0;     // until which it stays out
  bool touching = false, felt = true;
};

// B·rate, kept such that the normal force as a whole never pulls the tool in: at least −normal_N, the force
// of the spring. It resists on the way in and out. Sampled damping is not passive by nature (Colgate &
// Schenkel 1997), so an account is kept of what the hand put into it, forgotten over kDampingMemory_s: when
// it has given back more than that, it is left out until it has earned as much on paper, and twice as much
// each time after. So it cannot feed an oscillation, however long the contact; the next contact starts
// afresh.
inline constexpr double kDampingMemory_s = 0.05;
// With `account` false it is felt whatever it gives back, as sampled damping is without such care.
double damping_force(DampingState& state, double normal_N, double depth_m, double damping_N_s_per_m,
                     double dt_s, double noise_m, bool account = true) noexcept;
// Call in every tick without contact.
inline void end_damping(DampingState& state) noexcept {
  state = DampingState{};
}

// ---- force shading (thesis, Fig 5; Morgenbesser & Srinivasan 1996)
// -----------------------------------------

// A shaded normal further from the surface's own than this is turned back to this angle: at the silhouette of
// a coarse mesh, or over a sharp edge that stands for itself, the force must still push out.
inline constexpr double kLeastShadedCosine = 0.5;  // 60°

// `shaded` turned towards `normal` (both unit) until shaded·normal >= least_cosine. `normal` where `shaded`
// is not a unit vector or is its opposite. Continuous but there.
glm::dvec3 limit_shaded_normal(const glm::dvec3& shaded, const glm::dvec3& normal,
                               double least_cosine = kLeastShadedCosine) noexcept;

// The metric in which the proxy goes freely along the pull of the shaded normals, and hardly beside it: its
// step to the minimum of (q − goal)ᵀ M (q − goal) on the true planes is then to where the ways back from the
// goal along those normals meet the surface, so that A (goal − q) lies in their span. To repeat with the
// shaded normals at q until q stays: each pass brings it nearer by a factor of depth / (radius of curvature
// that the normals pretend + tool radius), below 1 wherever the depth is below that radius. (Ruspini's two
// passes, a goal level with the proxy and then the step towards it, were rejected: held by the true normals,
// the goal is thrown over a convex edge and back by the depth times the angle between the facets.) At most
// three normals count; `metric` when there are none.
glm::dmat3 shading_metric(const glm::dmat3& metric, std::span<const glm::dvec3> shaded_normals) noexcept;

}  // namespace hybrid
