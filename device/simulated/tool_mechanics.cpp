// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/simulated/tool_mechanics.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

namespace device {
namespace {

constexpr glm::dvec3 kRest(0.0);

// Time (s) for which friction of at most `most_N` holds the tool against a pull that changes linearly.
double stick_time_s(const glm::dvec3& pull_N, const glm::dvec3& growth_N_per_s, double most_N) noexcept {
  const double spare = most_N * most_N - glm::dot(pull_N, pull_N);
  if (spare < 0.0) return 0.0;
  const double growth2 = glm::dot(growth_N_per_s, growth_N_per_s);
  if (growth2 <= 0.0) return std::numeric_limits<double>::infinity();
  const double along = glm::dot(pull_N, growth_N_per_s);
  const double root = std::sqrt(along * along + growth2 * spare);
  // The larger root, in the form without cancellation.
  return along > 0.0 ? spare / (root + along) : (root - along) / growth2;
}

}  // namespace

struct ToolIntegrator::AppliedForces {
  glm::dvec3 motor_N, target_m, target_m_per_s;  // target at the start of the step
  double mass_kg, stiffness_N_per_m, viscous_N_s_per_m;

  [[nodiscard]] glm::dvec3 target(double at_s) const noexcept { return target_m + at_s * target_m_per_s; }

  // The motion after flow.time_s under a constant `friction_N`. It begins at_s after the start of the step.
  [[nodiscard]] ToolMotion after(const LinearFlow& flow, const ToolMotion& motion, double at_s,
                                 const glm::dvec3& friction_N) const noexcept {
    // The flow is relative to the target. The mechanism's viscous friction is relative to the ground.
    const glm::dvec3 speed = motion.velocity_m_per_s - target_m_per_s;
    const glm::dvec3 pull = (motor_N + friction_N - viscous_N_s_per_m * target_m_per_s +
                             stiffness_N_per_m * (target(at_s) - motion.position_m)) /
                            mass_kg;
    return {motion.position_m + flow.time_s * target_m_per_s + flow.from_velocity_s * speed +
                flow.from_acceleration_s2 * pull,
            target_m_per_s + flow.velocity_factor * speed + flow.from_velocity_s * pull};
  }
};

LinearFlow ToolIntegrator::new_flow(double time_s) const noexcept {
  return linear_flow(mechanics_.mass_kg, mechanics_.hand_damping_N_s_per_m + mechanics_.viscous_N_s_per_m,
                     mechanics_.hand_stiffness_N_per_m, time_s);
}

const LinearFlow& ToolIntegrator::flow(double time_s) noexcept {
  for (const LinearFlow& known : flows_) {
    if (known.time_s == time_s) return known;
  }
  LinearFlow& slot = flows_[oldest_];
  oldest_ = (oldest_ + 1) % flows_.size();
  slot = new_flow(time_s);
  return slot;
}

// One substep in which the tool moves or begins to move.
double ToolIntegrator::slip(ToolMotion& motion, const AppliedForces& pull, double at_s,
                            const LinearFlow& step) const noexcept {
  const double most_N = mechanics_.coulomb_N, step_s = step.time_s;
  const glm::dvec3 free_end = pull.after(step, motion, at_s, kRest).velocity_m_per_s;
  const double speed = glm::length(motion.velocity_m_per_s);
  const double lost = most_N * step_s / mechanics_.mass_kg;  // speed lost to friction
  glm::dvec3 along = speed > 0.0 ? motion.velocity_m_per_s / speed : free_end;
  // The direction of friction is implicit, because friction turns a slow motion within much less than a
  // substep. Let v be the velocity in the middle of the substep, and w that velocity without friction. Then
  // v = w − ½·lost·v/|v|, so v has the direction of w. A motion slower than `lost` uses the direction at the
  // end instead. A motion that reverses keeps its own direction, and is stopped first.
  const glm::dvec3 middle = speed > lost ? motion.velocity_m_per_s + free_end : free_end;
  if (const double length = glm::length(middle);
      length > 0.0 && (speed <= 0.0 || glm::dot(middle, along) > 0.5 * length)) {
    along = middle / length;
  }

  ToolMotion moved = pull.after(step, motion, at_s, -most_N * along);
  const double before = glm::dot(motion.velocity_m_per_s, along),
               after = glm::dot(moved.velocity_m_per_s, along);
  double time_s = step_s;
  if (after <= 0.0) {  // the tool stops within the substep
    if (before > 0.0) {
      // The method of false position finds the moment: over a substep the speed falls almost linearly.
      double low_s = 0.0, low = before, high_s = step_s, high = after;
      for (int i = 0; i < 4; ++i) {
        time_s = low_s + (high_s - low_s) * (low / (low - high));
        moved = pull.after(new_flow(time_s), motion, at_s, -most_N * along);
        const double now = glm::dot(moved.velocity_m_per_s, along);
        (now > 0.0 ? low_s : high_s) = time_s;
        (now > 0.0 ? low : high) = now;
      }
    } else {
      moved.position_m = motion.position_m;
    }
    moved.velocity_m_per_s = kRest;
  }
  if (glm::dot(moved.position_m - motion.position_m, along) < 0.0) {
    // The tool oscillates within the substep and ends behind its start, seen along `along`. A constant
    // friction along -`along` would have done positive work. So the substep is computed without friction, and
    // the impulse of friction is then subtracted from the momentum.
    time_s = step_s;
    moved = pull.after(step, motion, at_s, kRest);
    const double left = glm::length(moved.velocity_m_per_s);
    moved.velocity_m_per_s *= left > lost ? 1.0 - lost / left : 0.0;
  }
  motion = moved;
  return time_s;
}

// Stick and slip: the tool rests as long as friction can hold it, then slips in substeps.
void ToolIntegrator::advance_with_friction(ToolMotion& motion, const AppliedForces& pull,
                                           double dt_s) noexcept {
  constexpr double kMaxSubsteps = 50'000.0;
  // Rounding does not add a substep to a tick that is a whole number of substeps.
  const double step_s = dt_s / std::clamp(std::ceil(dt_s / max_substep_s_ - 1e-6), 1.0, kMaxSubsteps);
  const double nothing_s = 1e-9 * step_s;
  double at_s = 0.0;
  // The loop terminates: after a stop within a substep the tool sticks, or slips for a whole substep.
  while (dt_s - at_s > nothing_s) {
    if (motion.velocity_m_per_s == kRest) {
      const double stiffness = mechanics_.hand_stiffness_N_per_m;
      const glm::dvec3 pull_N = pull.motor_N + stiffness * (pull.target(at_s) - motion.position_m) +
                                mechanics_.hand_damping_N_s_per_m * pull.target_m_per_s;
      at_s += stick_time_s(pull_N, stiffness * pull.target_m_per_s, mechanics_.coulomb_N);
      if (!(dt_s - at_s > nothing_s)) return;
    }
    const double left_s = dt_s - at_s;
    at_s += left_s > step_s - nothing_s ? slip(motion, pull, at_s, flow(step_s))
                                        : slip(motion, pull, at_s, new_flow(left_s));
  }
}

void ToolIntegrator::advance(ToolMotion& motion, const glm::dvec3& target_start_m,
                             const glm::dvec3& target_end_m, const glm::dvec3& motor_force_N,
                             double dt_s) noexcept {
  if (!(dt_s > 0.0) || !std::isfinite(dt_s)) return;
  const AppliedForces pull{.motor_N = motor_force_N,
                           .target_m = target_start_m,
                           .target_m_per_s = (target_end_m - target_start_m) / dt_s,
                           .mass_kg = mechanics_.mass_kg,
                           .stiffness_N_per_m = mechanics_.hand_stiffness_N_per_m,
                           .viscous_N_s_per_m = mechanics_.viscous_N_s_per_m};
  if (mechanics_.coulomb_N > 0.0) {
    advance_with_friction(motion, pull, dt_s);
  } else {
    motion = pull.after(flow(dt_s), motion, 0.0, kRest);
  }
}

}  // namespace device
