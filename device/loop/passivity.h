// SPDX-License-Identifier: GPL-3.0-or-later
// Time-domain passivity: an observer of the energy that a force hands out, and a controller that takes as
// much of the force away as keeps that bounded. After Hannaford & Ryu, IEEE Trans. Robotics & Automation 18
// (2002).
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>

namespace device {

struct PassivityOptions {
  double resolution_m = 0.0;  // encoder step
  // What a tool does at most: faster than this it is taken to be at the start (unit: m/s), and between two
  // ticks it gains no more speed than this acceleration gives (unit: m/s²; 300 is 24 N on 81 g).
  double max_speed_m_per_s = 2.0;
  double max_acceleration_m_per_s2 = 300.0;
  double release_s = 0.05;  // of work against a force, over which what was taken away of it comes back
  double jnd_share = 0.07, jnd_floor_N = 0.04;  // what of a force a hand can tell, for most_taken_jnd
  double forget_s = 0.1;  // over which energy taken in is forgotten while nothing is felt
};

struct PassivityState {
  glm::dvec3 last_N{0.0}, last_m{0.0};
  bool started = false;
  double given_J = 0.0;       // handed out less taken in, Σ F(k−1)·(x(k) − x(k−1)), F on the hand
  double worst_tick_J = 0.0;  // the largest |F(k−1)·(x(k) − x(k−1))| there was
  double stride_m = 0.0;      // the longest way of a tick of late
  double depth_m = 0.0;       // the way against the force since it began
  double share = 1.0;         // of the force that goes out

  // For reports.
  double most_given_J = 0.0;  // given_J at its highest
  std::uint64_t felt = 0;     // ticks with a force to take from
  std::uint64_t acted = 0;    // of these, the ones in which some was taken
  std::uint64_t jumps = 0;    // ways longer than foreseen: the bound below did not count on them
  double most_taken_N = 0.0;
  double most_taken_jnd = 0.0;  // by the options' figures
  double taken_sum_N2 = 0.0;    // of squares, a tick
};

// The force that goes out: `force_N` times a share of 0 to 1, for a tool that the encoders tell at
// position_m. It never adds to a force, turns it, or lets more through than was asked, so every limit on
// force_N holds for it too; it is the last to act.
//
// What is held, at every tick: given_J <= worst_tick_J + 0.1 µJ, for every motion whose ways between ticks
// are no longer than twice the longest of late plus max_acceleration·dt² plus an encoder step (`jumps` counts
// the others). No controller that plays any force after a first tick that lost energy can hold more: the next
// tick may lose as much again.
//   - While no more was handed out than taken in: on the way out, the share is what the energy taken in can
//     sustain back to where the force began, as a spring would. So a wall that a sampled loop cannot hold is
//     felt as the softer one that it can. Before anything was taken in, a force is small.
//   - Once more was handed out, no more force goes out than would hand out the rest of worst_tick_J, should
//   the
//     tool turn against it and go as far as it can; and none along the last motion.
//   - Force that was taken away comes back while it is worked against, or when nothing is felt. (Giving it
//   back
//     with time was rejected: a spring that stiffens while it is pressed hands out energy.)
// Two faults of the original are avoided by taking a share instead of adding a damper: nothing is divided by
// a speed, so that noise at rest is not amplified; and the energy is never reset while a force is felt, nor
// is force given back faster than over release_s, so there is no kick. Never throws, never allocates.
glm::dvec3 keep_passive(const PassivityOptions& options, PassivityState& state, const glm::dvec3& force_N,
                        const glm::dvec3& position_m, double dt_s) noexcept;

}  // namespace device
