// SPDX-License-Identifier: GPL-3.0-or-later
// The mechanics of a simulated tool: one mass between a hand that pulls it along and motors that push it.
#pragma once

#include <array>
#include <cstddef>
#include <glm/vec3.hpp>

#include "device/simulated/linear_flow.h"

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

// The longest substep where there is Coulomb friction (unit: second).
inline constexpr double kToolSubstep_s = 1e-4;

// Moves the tool under a constant motor force while the hand's target moves evenly.
//
// Mass, springs and dampers follow their closed form, so without friction any time is one step, exact.
// Coulomb friction is constant in size and against the motion; its direction is frozen over a substep, at
// that of the substep's middle. What is left is again linear with a constant force, so
//   - along a straight line friction is exact too, up to the moment of stopping, which is found;
//   - on a curve the error falls with the substep's square;
//   - friction brings a motion to a stop exactly, never turns it round, and at rest holds it to the last bit
//     until what pulls exceeds it, at a moment that is solved for;
//   - no energy comes from nothing: the flow has none to give, and friction's work is checked in every
//     substep.
// Backward Euler, in substeps of 0.02 ms, was rejected: it adds damping of its own (0.006 N·s/m at 600 N/m,
// and 0.25 with a wall of 25 kN/m), enough to move a stability boundary.
class ToolIntegrator {
 public:
  explicit ToolIntegrator(const ToolMechanics& mechanics, double max_substep_s = kToolSubstep_s)
      : mechanics_(mechanics), max_substep_s_(max_substep_s) {}

  // By dt_s; not above zero or not finite moves nothing. A longer time than five seconds is cut into 50,000
  // longer substeps: late, not hung.
  void advance(ToolMotion& motion, const glm::dvec3& target_start_m, const glm::dvec3& target_end_m,
               const glm::dvec3& motor_force_N, double dt_s) noexcept;

 private:
  struct Pull;  // what acts on the tool
  [[nodiscard]] LinearFlow new_flow(double time_s) const noexcept;
  [[nodiscard]] const LinearFlow& flow(double time_s) noexcept;  // known from before, or kept for later
  void rub(ToolMotion& motion, const Pull& pull, double dt_s) noexcept;
  // Returns the time until the tool stopped, or all of it.
  double slip(ToolMotion& motion, const Pull& pull, double at_s, const LinearFlow& step) const noexcept;

  ToolMechanics mechanics_;
  double max_substep_s_;
  // The coefficients of the last few times: ticks are alike.
  std::array<LinearFlow, 4> flows_{};
  std::size_t oldest_ = 0;
};

}  // namespace device
