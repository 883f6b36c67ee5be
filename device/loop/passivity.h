// SPDX-License-Identifier: GPL-3.0-or-later
// Time-domain passivity: an observer of the energy that a force gives to the hand, and a controller that
// reduces the force to bound it. After Hannaford & Ryu, IEEE Trans. Robotics & Automation 18 (2002).
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>

namespace device {

struct PassivityOptions {
  double resolution_m = 0.0;  // encoder step
  // Bounds on the tool's motion. max_speed is assumed at the start (unit: m/s). Between two ticks the speed
  // gains at most max_acceleration·dt (unit: m/s²; 300 is 24 N on 81 g).
  double max_speed_m_per_s = 2.0;
  double max_acceleration_m_per_s2 = 300.0;
  double release_s = 0.05;  // of work against the force, over which a reduced share recovers
  double jnd_share = 0.07, jnd_floor_N = 0.04;  // what a hand can tell of a force, for most_taken_jnd
  double forget_s = 0.1;  // time constant of forgetting stored energy while no force is commanded
};

struct PassivityState {
  glm::dvec3 last_N{0.0}, last_m{0.0};
  bool started = false;
  // Energy given less energy taken in: Σ F(k−1)·(x(k) − x(k−1)), F on the hand.
  double given_J = 0.0;
  double worst_tick_J = 0.0;  // the largest |F(k−1)·(x(k) − x(k−1))| so far
  double stride_m = 0.0;      // the longest recent step of a tick
  double depth_m = 0.0;       // distance moved against the force since it began
  double share = 1.0;         // of the force that goes out

  // For reports.
  double most_given_J = 0.0;  // maximum of given_J
  std::uint64_t felt = 0;     // ticks with a force
  std::uint64_t acted = 0;    // ticks in which the force was reduced
  std::uint64_t jumps = 0;    // steps longer than the bound below allows
  double most_taken_N = 0.0;
  double most_taken_jnd = 0.0;  // in units of the options' just noticeable difference
  double taken_sum_N2 = 0.0;    // sum of squares over ticks
};

// The force to send: `force_N` times a share of 0 to 1, for a tool whose encoders report position_m. The
// force is never increased or turned, so every limit on force_N still holds. This is the last operation on a
// force.
//
// Guarantee at every tick: given_J <= worst_tick_J + 0.1 µJ. It holds for every motion whose step per tick is
// at most twice the longest recent one, plus max_acceleration·dt², plus an encoder step (`jumps` counts the
// others). No controller can guarantee more once a first tick has lost energy, because the next one may lose
// as much again.
//   - given_J <= 0: on the way out the share is limited to what the stored energy can sustain back to
//     where the force began, as a spring's would. So a wall that a sampled loop cannot hold is felt as
//     the softer one that it can. Before any energy was stored, the force is limited to a small value.
//   - given_J > 0: the force is limited so that it gives no more than the rest of worst_tick_J, should
//     the tool turn and move as far as it can. It is zero along the last motion.
//   - A reduced share recovers while the tool works against the force, or while no force is commanded.
//     It does not recover with time alone: a spring that stiffens while it is pressed gives energy.
// The original adds a damper instead of reducing the force. Reducing avoids the division by a speed, which
// would amplify noise at rest. The energy is not reset while a force is felt, and the share recovers no
// faster than over release_s, so there is no kick. Never throws, never allocates.
glm::dvec3 keep_passive(const PassivityOptions& options, PassivityState& state, const glm::dvec3& force_N,
                        const glm::dvec3& position_m, double dt_s) noexcept;

}  // namespace device
