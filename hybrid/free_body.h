// SPDX-License-Identifier: GPL-3.0-or-later
// One step of a free rigid body under contacts that may be far stiffer than its mass could follow.
//
// Linearly implicit Euler (Baraff & Witkin 1998, section 3): every contact answers to the velocity that the
// step ends with, (M + dt·D + dt²·Σ k·JᵀJ) v = M·v₀ + dt·f, so that no stiffness, mass or dt makes it grow. A
// contact that would have to pull is let go. Turning is taken apart from pushing: the torque-free part is the
// implicit midpoint rule with a Cayley rotation (Lewis & Simo 1994), which keeps angular momentum and energy
// to rounding.
#pragma once

#include <cstdint>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <span>

#include "hybrid/mass_properties.h"
#include "hybrid/scene.h"

namespace hybrid {

struct FreeBody {  // constant
  MassProperties mass;
  double drag_N_s_per_m = 0.0, angular_drag_N_m_s = 0.0;
  glm::dvec3 gravity_m_per_s2{0.0};
  // A body that is thrown faster than this is held to it: nothing that is felt moves so fast.
  double max_speed_m_per_s = 20.0;
  double max_spin_rad_per_s = 300.0;
};

struct FreeBodyState {
  glm::dvec3 centre_m{0.0};                 // of mass, scene frame
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};  // body to scene, unit
  glm::dvec3 velocity_m_per_s{0.0};         // of the centre of mass, scene frame
  glm::dvec3 spin_rad_per_s{0.0};           // scene frame
};

FreeBodyState state_at(const FreeBody& body, const Pose& pose);
Pose pose_of(const FreeBody& body, const FreeBodyState& state) noexcept;

// Something that presses on the body: `force_N` now, along `normal` (unit, the way the force pushes the
// body), less by `stiffness_N_per_m` (>= 0) for each meter that `point_m` gives way along it. A damper b is
// b/dt more stiffness (and b · approach speed more force). Friction is a contact of its own, along the
// surface.
struct BodyContact {
  glm::dvec3 point_m{0.0}, normal{0.0};  // scene frame
  double force_N = 0.0, stiffness_N_per_m = 0.0;
};

// Beyond so many contacts the rest press, and are never let go within the step. (Voxels of tissue are
// hundreds of contacts. One stiffness for all of them was rejected: where a body leaves, what should let go
// pulls.)
inline constexpr std::size_t kMaxOneSided = 4096;

// Advances the body by dt_s. Pure, bounded, allocates nothing. False when the outcome would not be finite (an
// input was not): the body then stands still where it was, and contacts that are not finite are what to look
// for.
bool step_free_body(const FreeBody& body, FreeBodyState& state, std::span<const BodyContact> contacts,
                    double dt_s) noexcept;

// Kinetic energy (J) and angular momentum about the centre of mass (kg m²/s, scene frame).
double kinetic_energy_J(const FreeBody& body, const FreeBodyState& state) noexcept;
glm::dvec3 angular_momentum(const FreeBody& body, const FreeBodyState& state) noexcept;

}  // namespace hybrid
