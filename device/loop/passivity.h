// SPDX-License-Identifier: GPL-3.0-or-later
// Time-domain passivity: an observer of the energy that a force gives to the hand, and a controller that
// reduces the force to bound this energy. After Hannaford & Ryu, IEEE Trans. Robotics & Automation 18 (2002).
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>

namespace device {

struct PassivityOptions {
  double resolution_m = 0.0;  // encoder step
  // Bounds on the tool's motion. The speed at the start is assumed to be max_speed. Between two ticks it
  // grows by at most max_acceleration·dt. 300 m/s² is 24 N on 81 g.
  double max_speed_m_per_s = 2.0;
  double max_acceleration_m_per_s2 = 300.0;
  double release_s = 0.05;  // a share recovers from 0 to 1 over this time of work against the force
  double jnd_share = 0.07, jnd_floor_N = 0.04;  // just noticeable difference, for most_taken_jnd
  double forget_s = 0.1;  // time constant of forgetting stored energy while no force is commanded
};

struct PassivityState {
  glm::dvec3 last_N{0.0}, last_m{0.0};
  bool started = false;
  // Energy given to the hand minus energy taken from it: Σ F(k−1)·(x(k) − x(k−1)), F on the hand.
  double given_J = 0.0;
  double worst_tick_J = 0.0;  // the largest |F(k−1)·(x(k) − x(k−1))| so far
  double stride_m = 0.0;      // the longest recent step of the tool in a tick
  double depth_m = 0.0;       // distance that the tool moved against the force since the force began
  double share = 1.0;         // share of the force that is sent

  // For reports.
  double most_given_J = 0.0;  // maximum of given_J
  std::uint64_t felt = 0;     // ticks with a force
  std::uint64_t acted = 0;    // ticks in which the force was reduced
  std::uint64_t jumps = 0;    // steps longer than keep_passive() allows for
  double most_taken_N = 0.0;
  double most_taken_jnd = 0.0;  // in units of the options' just noticeable difference
  double taken_sum_N2 = 0.0;    // sum of squares over ticks
};

// Returns the force to send: `force_N` times a share from 0 to 1. `position_m` is the tool's position as the
// encoders report it. The force is never increased or turned, so every limit on force_N still holds. This is
// the last operation on a force.
//
// Guarantee at every tick: given_J <= worst_tick_J + 0.1 µJ. It holds for every motion whose step per tick is
// at most twice the longest recent one, plus max_acceleration·dt², plus an encoder step (`jumps` counts the
// others). No controller can guarantee more: if one tick has given energy, the next tick may give as much
// again.
//   - given_J <= 0, while the tool moves out: the share is limited so that the stored energy lasts until the
//     tool is back where the force began, as with a spring. So a wall that the sampled loop cannot hold is
//     felt as a softer wall. Before any energy is stored, the force has a small limit.
//   - given_J > 0: the tool might turn and move as far as the bound allows. The force is limited so that it
//     would then give no more than worst_tick_J − given_J. The force is zero if the tool's last step was
//     along it.
//   - A reduced share recovers while the tool works against the force, or while no force is commanded.
//     It does not recover with time alone: a spring that stiffens while it is pressed gives energy.
// Hannaford & Ryu add a damper instead of reducing the force. A damper needs a division by the speed, which
// would amplify noise at rest. The energy is not reset while a force is felt, and the share recovers no
// faster than over release_s, so there is no kick. Never throws, never allocates.
glm::dvec3 keep_passive(const PassivityOptions& options, PassivityState& state, const glm::dvec3& force_N,
                        const glm::dvec3& position_m, double dt_s) noexcept;

}  // namespace device
