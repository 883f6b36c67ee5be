// SPDX-License-Identifier: GPL-3.0-or-later
// The mechanics of a simulated tool: one mass between a hand that pulls it along and motors that push it.
#pragma once

#include <glm/vec3.hpp>

namespace device {

struct ToolMechanics {
  double mass_kg = 0.0;            // apparent mass of the mechanism and mass of the hand; > 0
  double viscous_N_s_per_m = 0.0;  // of the mechanism, against the ground
  double coulomb_N = 0.0;          // of the mechanism
  double hand_damping_N_s_per_m = 0.0;
  double hand_stiffness_N_per_m = 0.0;
};

struct ToolMotion {
  glm::dvec3 position_m{0.0};
  glm::dvec3 velocity_m_per_s{0.0};
};

// The longest substep (unit: second). A step of the hand's target by 10 mm is then followed within 12 µm.
inline constexpr double kToolSubstep_s = 2e-5;

// Moves the tool by dt_s under a constant motor force, while the hand's target moves evenly from target_start
// to target_end. Each substep is implicit in hand, viscous and Coulomb friction alike (backward Euler, the
// friction as a projection), so that
//   - it is stable for any stiffness and damping >= 0, and never creates energy;
//   - friction brings a motion to a stop exactly, never turns it round, and at rest holds it to the last bit.
// A longer tick than one second is cut into 50,000 longer substeps: late, not hung.
// dt_s not above zero moves nothing.
void advance(const ToolMechanics& mechanics, ToolMotion& motion, const glm::dvec3& target_start_m,
             const glm::dvec3& target_end_m, const glm::dvec3& motor_force_N, double dt_s,
             double max_substep_s = kToolSubstep_s) noexcept;

}  // namespace device
