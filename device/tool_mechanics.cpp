// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/tool_mechanics.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace device {

void advance(const ToolMechanics& mechanics, ToolMotion& motion, const glm::dvec3& target_start_m,
             const glm::dvec3& target_end_m, const glm::dvec3& motor_force_N, double dt_s,
             double max_substep_s) noexcept {
  if (!(dt_s > 0.0) || !std::isfinite(dt_s)) return;
  constexpr double kMaxSubsteps = 50'000.0;
  // A tick that is a whole number of substeps but for rounding is not cut once more.
  const double substeps = std::clamp(std::ceil(dt_s / max_substep_s - 1e-6), 1.0, kMaxSubsteps);
  const double h = dt_s / substeps;

  const double k = mechanics.hand_stiffness_N_per_m;
  const double d = mechanics.hand_damping_N_s_per_m;
  const double inertia = mechanics.mass_kg / h;
  const double resistance = inertia + h * k + d + mechanics.viscous_N_s_per_m;
  const glm::dvec3 target_velocity = (target_end_m - target_start_m) / dt_s;

  const int count = static_cast<int>(substeps);
  for (int i = 1; i <= count; ++i) {
    const glm::dvec3 target = target_start_m + (target_end_m - target_start_m) * (i / substeps);
    // m·(v' − v)/h = F + k·(target' − x − h·v') + d·(v_target − v') − b·v' − friction(v'), solved for v'.
    const glm::dvec3 push = inertia * motion.velocity_m_per_s + motor_force_N +
                            k * (target - motion.position_m) + d * target_velocity;
    // friction(v') lies along v' with magnitude coulomb_N, or is whatever below it holds v' at zero: the push
    // is shortened by coulomb_N, and one that is shorter than that is held.
    const double strength = glm::length(push);
    motion.velocity_m_per_s = strength > mechanics.coulomb_N
                                  ? push * ((1.0 - mechanics.coulomb_N / strength) / resistance)
                                  : glm::dvec3(0.0);
    motion.position_m += h * motion.velocity_m_per_s;
  }
}

}  // namespace device
