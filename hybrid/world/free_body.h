// SPDX-License-Identifier: GPL-3.0-or-later
// One step of free rigid bodies under contacts that may be far stiffer than explicit integration allows.
//
// Linearly implicit Euler (Baraff & Witkin 1998, section 3): contact forces are those at the velocity v at
// the end of the step, which solves (M + dt·D + dt²·Σ k·JᵀJ) v = M·v₀ + dt·f. So the step is stable for every
// stiffness, mass and dt. A contact that would have to pull is released. Bodies that touch one another are
// solved together. The torque-free rotation is a separate step: the implicit midpoint rule with a Cayley
// rotation (Lewis & Simo 1994), which keeps angular momentum and energy to rounding.
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
  // Speeds are clamped to these bounds: nothing that can be felt moves so fast.
  double max_speed_m_per_s = 20.0;
  double max_spin_rad_per_s = 300.0;
};

struct FreeBodyState {
  glm::dvec3 centre_m{0.0};                 // centre of mass, scene frame
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};  // body to scene, unit
  glm::dvec3 velocity_m_per_s{0.0};         // of the centre of mass, scene frame
  glm::dvec3 spin_rad_per_s{0.0};           // scene frame
};

// The same body without gravity and drag: contacts alone act on it.
FreeBody without_external_loads(const FreeBody& body) noexcept;

FreeBodyState state_at(const FreeBody& body, const Pose& pose);
Pose pose_of(const FreeBody& body, const FreeBodyState& state) noexcept;

// A contact force on the body along `normal` (unit; the direction in which the contact pushes the body). The
// force is `force_N` at the start of the step. It falls by `stiffness_N_per_m` (>= 0) for each meter that
// `point_m` moves along `normal`. A damper b (N s/m) is modelled by b/dt more stiffness and b · approach
// speed more force. If `other` is a free body, it takes the opposite force. `friction` is Coulomb's
// coefficient.
struct BodyContact {
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  glm::dvec3 point_m{0.0}, normal{0.0};  // scene frame
  double force_N = 0.0, stiffness_N_per_m = 0.0;
  double friction = 0.0;
  // Indices of bodies that step together; kNone: the other side moves as prescribed.
  std::uint32_t body = 0, other = kNone;
  glm::dvec3 carried_m_per_s{0.0};  // prescribed velocity of the other side's surface
};

// Contacts beyond this number are bilateral: they are never released within the step. There may be hundreds
// of contacts: each voxel of tissue is a contact of its own, so that it can be released by itself.
inline constexpr std::size_t kMaxOneSided = 4096;

// One of the bodies that step together.
struct SteppedBody {
  const FreeBody* body = nullptr;
  FreeBodyState state;   // before the step, then after it
  bool stopped = false;  // the result would not have been finite: the body stands still where it was
};

// A contact on the line from one velocity solution to the next. Its force is `from_N` at the start of the
// line and `from_N + more_N` at the end. Its slip is `slip` and `slip + more_slip`.
struct ContactOnLine {
  double from_N, more_N;
  double moved_m;  // difference between both solutions in the point's motion along the normal
  double friction_N;
  std::array<double, 2> slip, more_slip;  // m/s
};

// Workspace for several bodies: (6·bodies)² numbers.
class BodySystem {
 public:
  explicit BodySystem(std::size_t most_bodies = 0);
  [[nodiscard]] std::size_t most_bodies() const noexcept { return first_.size(); }

 private:
  friend void step_free_bodies(std::span<SteppedBody> bodies, std::span<const BodyContact> contacts,
                               BodySystem& system, double dt_s) noexcept;
  std::vector<double> matrix_, twists_;
  std::vector<std::uint32_t> first_;  // [body] lowest index among the body and those in contact with it
  std::vector<ContactOnLine> lines_;
};

// Advances the first system.most_bodies() of the bodies by dt_s; further bodies are left as they are.
// Bounded, allocates nothing. A body without contact to others gets the same result as alone.
void step_free_bodies(std::span<SteppedBody> bodies, std::span<const BodyContact> contacts,
                      BodySystem& system, double dt_s) noexcept;

// Advances one body by dt_s under its contacts. Pure, bounded, allocates nothing. Returns false if the result
// would not be finite because an input was not. The body then stands still where it was.
bool step_free_body(const FreeBody& body, FreeBodyState& state, std::span<const BodyContact> contacts,
                    double dt_s) noexcept;

// Kinetic energy (J) and angular momentum about the centre of mass (kg m²/s, scene frame).
double kinetic_energy_J(const FreeBody& body, const FreeBodyState& state) noexcept;
glm::dvec3 angular_momentum(const FreeBody& body, const FreeBodyState& state) noexcept;

}  // namespace hybrid
