// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/simulated/tool_mechanics.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

namespace device {
namespace {

constexpr glm::dvec3 kRest(0.0);

// For how long friction of `most_N` holds against a pull that grows evenly.
double held_for(const glm::dvec3& pull_N, const glm::dvec3& growth_N_per_s, double most_N) noexcept {
  const double spare = most_N * most_N - glm::dot(pull_N, pull_N);
  if (spare < 0.0) return 0.0;
  const double growth2 = glm::dot(growth_N_per_s, growth_N_per_s);
  if (growth2 <= 0.0) return std::numeric_limits<double>::infinity();
  const double along = glm::dot(pull_N, growth_N_per_s);
  const double root = std::sqrt(along * along + growth2 * spare);
  // The way to the greater of the two solutions that subtracts nothing.
  return along > 0.0 ? spare / (root + along) : (root - along) / growth2;
}

}  // namespace

struct ToolIntegrator::Pull {
  glm::dvec3 motor_N, target_m, target_m_per_s;  // the target where it is at the start
  double mass_kg, stiffness_N_per_m, viscous_N_s_per_m;

  [[nodiscard]] glm::dvec3 target(double at_s) const noexcept { return target_m + at_s * target_m_per_s; }

  // Along the linear flow, with `friction_N` constant.
  [[nodiscard]] ToolMotion after(const LinearFlow& flow, const ToolMotion& motion, double at_s,
                                 const glm::dvec3& friction_N) const noexcept {
    // Relative to the target; the mechanism's viscous friction is against the ground all the same.
    const glm::dvec3 speed = motion.velocity_m_per_s - target_m_per_s;
    const glm::dvec3 pull = (motor_N + friction_N - viscous_N_s_per_m * target_m_per_s +
                             stiffness_N_per_m * (target(at_s) - motion.position_m)) /
                            mass_kg;
    return {motion.position_m + flow.time_s * target_m_per_s + flow.from_speed_s * speed +
                flow.from_pull_s2 * pull,
            target_m_per_s + flow.keep * speed + flow.from_speed_s * pull};
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

// One substep in which the tool moves, or begins to.
double ToolIntegrator::slip(ToolMotion& motion, const Pull& pull, double at_s,
                            const LinearFlow& step) const noexcept {
  const double most_N = mechanics_.coulomb_N, step_s = step.time_s;
  const glm::dvec3 free_end = pull.after(step, motion, at_s, kRest).velocity_m_per_s;
  const double speed = glm::length(motion.velocity_m_per_s);
  const double lost = most_N * step_s / mechanics_.mass_kg;  // of the speed, to friction
  glm::dvec3 along = speed > 0.0 ? motion.velocity_m_per_s / speed : free_end;
  // Implicit, so that the direction of a slow motion, which friction corrects within far less than a substep,
  // does not swing: that of v in the middle, v = w − ½·lost·v/|v| with w the middle without friction, is w's;
  // of a slower motion that at the end is the end's. One that turns about is stopped as it is, first.
  const glm::dvec3 middle = speed > lost ? motion.velocity_m_per_s + free_end : free_end;
  if (const double length = glm::length(middle);
      length > 0.0 && (speed <= 0.0 || glm::dot(middle, along) > 0.5 * length)) {
    along = middle / length;
  }

  ToolMotion moved = pull.after(step, motion, at_s, -most_N * along);
  const double before = glm::dot(motion.velocity_m_per_s, along),
               after = glm::dot(moved.velocity_m_per_s, along);
  double time_s = step_s;
  if (after <= 0.0) {  // it stops on the way
    if (before > 0.0) {
      // By false position: speeds fall almost straight over a substep.
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
    // A substep in which the tool swings to and fro: friction so directed would have pushed it along. It
    // takes its impulse from the motion at the end instead.
    time_s = step_s;
    moved = pull.after(step, motion, at_s, kRest);
    const double left = glm::length(moved.velocity_m_per_s);
    moved.velocity_m_per_s *= left > lost ? 1.0 - lost / left : 0.0;
  }
  motion = moved;
  return time_s;
}

// With Coulomb friction: holds while it can, then slips in substeps.
void ToolIntegrator::rub(ToolMotion& motion, const Pull& pull, double dt_s) noexcept {
  constexpr double kMaxSubsteps = 50'000.0;
  // A tick that is a whole number of substeps but for rounding is not cut once more.
  const double step_s = dt_s / std::clamp(std::ceil(dt_s / max_substep_s_ - 1e-6), 1.0, kMaxSubsteps);
  const double nothing_s = 1e-9 * step_s;
  double at_s = 0.0;
  // A stop takes part of a substep, but then the tool holds, or takes a whole one to begin again.
  while (dt_s - at_s > nothing_s) {
    if (motion.velocity_m_per_s == kRest) {
      const double stiffness = mechanics_.hand_stiffness_N_per_m;
      const glm::dvec3 pull_N = pull.motor_N + stiffness * (pull.target(at_s) - motion.position_m) +
                                mechanics_.hand_damping_N_s_per_m * pull.target_m_per_s;
      at_s += held_for(pull_N, stiffness * pull.target_m_per_s, mechanics_.coulomb_N);
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
  const Pull pull{.motor_N = motor_force_N,
                  .target_m = target_start_m,
                  .target_m_per_s = (target_end_m - target_start_m) / dt_s,
                  .mass_kg = mechanics_.mass_kg,
                  .stiffness_N_per_m = mechanics_.hand_stiffness_N_per_m,
                  .viscous_N_s_per_m = mechanics_.viscous_N_s_per_m};
  if (mechanics_.coulomb_N > 0.0) {
    rub(motion, pull, dt_s);
  } else {
    motion = pull.after(flow(dt_s), motion, 0.0, kRest);
  }
}

}  // namespace device
