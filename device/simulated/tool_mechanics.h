// SPDX-License-Identifier: GPL-3.0-or-later
// Mechanics of a simulated tool: one mass, pulled by a hand and pushed by motors.
#pragma once

#include <array>
#include <cstddef>
#include <glm/vec3.hpp>

#include "device/loop/linear_flow.h"

namespace device {

struct ToolMechanics {
  double mass_kg = 0.0;            // apparent mass of mechanism and hand; > 0
  double viscous_N_s_per_m = 0.0;  // of the mechanism, relative to the ground
  double coulomb_N = 0.0;          // of the mechanism
  double hand_damping_N_s_per_m = 0.0;
  double hand_stiffness_N_per_m = 0.0;
};

struct ToolMotion {
  glm::dvec3 position_m{0.0};
  glm::dvec3 velocity_m_per_s{0.0};
};

// The longest substep under Coulomb friction (unit: second).
inline constexpr double kToolSubstep_s = 1e-4;

// Moves the tool under a constant motor force, while the hand's target moves at constant velocity.
//
// Mass, spring and damper follow their closed form, so without friction a step of any length is exact.
// Coulomb friction has a constant magnitude and opposes the motion. Over a substep its direction is constant:
// that of the motion in the middle of the substep. So in each substep friction is a constant force, and
//   - along a straight line friction is exact too, up to the moment of stopping, which is solved for;
//   - on a curve the error falls with the square of the substep;
//   - friction stops a motion exactly, never reverses it, and holds a tool at rest to the last bit,
//     until the pull exceeds friction, at a moment that is solved for;
//   - no energy is created: the linear flow creates none, and the work of friction is checked in each
//     substep.
// Backward Euler cannot be used here, because its numerical damping would move the stability boundary.
class ToolIntegrator {
 public:
  explicit ToolIntegrator(const ToolMechanics& mechanics, double max_substep_s = kToolSubstep_s)
      : mechanics_(mechanics), max_substep_s_(max_substep_s) {}

  // Advances by dt_s. Nothing moves if dt_s is not positive and finite. Under friction, a dt_s above five
  // seconds is divided into 50,000 longer substeps, so that the work stays bounded.
  void advance(ToolMotion& motion, const glm::dvec3& target_start_m, const glm::dvec3& target_end_m,
               const glm::dvec3& motor_force_N, double dt_s) noexcept;

 private:
  struct AppliedForces;
  [[nodiscard]] LinearFlow new_flow(double time_s) const noexcept;
  [[nodiscard]] const LinearFlow& flow(double time_s) noexcept;  // cached
  void advance_with_friction(ToolMotion& motion, const AppliedForces& pull, double dt_s) noexcept;
  // Moves the tool by one substep, or until it stops. Returns the time that this took (s).
  double slip(ToolMotion& motion, const AppliedForces& pull, double at_s,
              const LinearFlow& step) const noexcept;

  ToolMechanics mechanics_;
  double max_substep_s_;
  // Coefficients of the last few step lengths, which repeat from tick to tick.
  std::array<LinearFlow, 4> flows_{};
  std::size_t oldest_ = 0;
};

}  // namespace device
