// SPDX-License-Identifier: GPL-3.0-or-later
// One step of free rigid bodies under contacts that may be far stiffer than their mass could follow.
//
// Linearly implicit Euler (Baraff & Witkin 1998, section 3): every contact answers to the velocity that the
// step ends with, (M + dt·D + dt²·Σ k·JᵀJ) v = M·v₀ + dt·f, so that no stiffness, mass or dt makes it grow. A
// contact that would have to pull is let go. Bodies that touch one another are solved as one. Turning is
// taken apart from pushing: the torque-free part is the implicit midpoint rule with a Cayley rotation (Lewis
// & Simo 1994), which keeps angular momentum and energy to rounding.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "hybrid/geometry/mass_properties.h"
#include "hybrid/scene/scene.h"

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

// The body by itself: nothing but contacts acts on it.
FreeBody alone(const FreeBody& body) noexcept;

FreeBodyState state_at(const FreeBody& body, const Pose& pose);
Pose pose_of(const FreeBody& body, const FreeBodyState& state) noexcept;

// Something that presses on the body: `force_N` now, along `normal` (unit, the way the force pushes the
// body), less by `stiffness_N_per_m` (>= 0) for each meter that `point_m` gives way along it. A damper b is
// b/dt more stiffness (and b · approach speed more force). What presses may be another free body, which takes
// the same the other way. `friction` is Coulomb's coefficient: with it what slides there is slowed down, by
// no more than so many times what presses.
struct BodyContact {
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  glm::dvec3 point_m{0.0}, normal{0.0};  // scene frame
  double force_N = 0.0, stiffness_N_per_m = 0.0;
  double friction = 0.0;
  std::uint32_t body = 0, other = kNone;  // of those that step together; kNone: it does not answer
  glm::dvec3 carried_m_per_s{0.0};        // the surface that does not answer moves by itself at this speed
};

// Beyond so many contacts the rest press, and are never let go within the step. (Voxels of tissue are
// hundreds of contacts. One stiffness for all of them was rejected: where a body leaves, what should let go
// pulls.)
inline constexpr std::size_t kMaxOneSided = 4096;

// One of the bodies that step together.
struct SteppedBody {
  const FreeBody* body = nullptr;
  FreeBodyState state;   // before the step, then after it
  bool stopped = false;  // its outcome would not have been finite: it stands still where it was
};

// What a contact presses with as velocities change from one solution to another.
struct ContactOnWay {
  double from_N, more_N;
  double way_m;  // how much more its point moves
  double friction_N;
  std::array<double, 2> slip, more_slip;  // m/s
};

// What solving for several bodies takes: (6·bodies)² numbers.
class BodySystem {
 public:
  explicit BodySystem(std::size_t most_bodies = 0);
  [[nodiscard]] std::size_t most_bodies() const noexcept { return first_.size(); }

 private:
  friend void step_free_bodies(std::span<SteppedBody> bodies, std::span<const BodyContact> contacts,
                               BodySystem& system, double dt_s) noexcept;
  std::vector<double> matrix_, twists_;
  std::vector<std::uint32_t> first_;  // [body] the first that it has a contact with, of those before it
  std::vector<ContactOnWay> ways_;
};

// Advances the bodies by dt_s, at most as many as there is room for. Bounded, allocates nothing. Bodies that
// are not in contact come out as each by itself would.
void step_free_bodies(std::span<SteppedBody> bodies, std::span<const BodyContact> contacts,
                      BodySystem& system, double dt_s) noexcept;

// The same for one body. Pure, bounded, allocates nothing. False when the outcome would not be finite (an
// input was not): the body then stands still where it was, and contacts that are not finite are what to look
// for.
bool step_free_body(const FreeBody& body, FreeBodyState& state, std::span<const BodyContact> contacts,
                    double dt_s) noexcept;

// Kinetic energy (J) and angular momentum about the centre of mass (kg m²/s, scene frame).
double kinetic_energy_J(const FreeBody& body, const FreeBodyState& state) noexcept;
glm::dvec3 angular_momentum(const FreeBody& body, const FreeBodyState& state) noexcept;

}  // namespace hybrid
