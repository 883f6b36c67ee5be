// SPDX-License-Identifier: GPL-3.0-or-later
// Invariants of every tick, for any scene and any input, checked from outside.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <string>

#include "hybrid/tick/tick.h"

namespace hybrid {

// The invariants:
//
// finite. Every result of a tick and every number of its state (proxy, poses, displacements) is finite.
//
// limits. The force is at most ForceLimits::max_force_N. It changes by at most max_slew_N_per_s times the
// tick, except to zero.
//
// energy. This invariant holds for tissue, and for standing rigid objects without friction, damping or
// texture. The hand may get the energy that coupling and tissue store when the checks begin. Let U(x) be the
// least energy of coupling and tissue that the proxy can reach when the device is at x. The proxy can stay
// where it was in the tick before, so for any surface the new energy is at most
//     U' <= ½K|x' − q|² = U − F·(x' − x) + ½K|x' − x|²,
// where F = K (q − x) is the force. So the work F·(x' − x) of the held force on the hand is at most the
// stored energy plus ½K|Δx|² in each tick. The term ½K|Δx|² is the cost of holding a force for a tick
// (Colgate & Schenkel 1997, K·T/2). An engine that adds no energy stays within the bound, even if the loop is
// not stable. With a coupling that is too stiff for the loop, this term alone can feed a buzz. With the clamp
// the same holds for the energy of the clamped spring. A slew limit delays a change ΔF of the force and may
// give |ΔF|·|Δx| more. This is added to the allowed energy, and is zero where the limit did not act. Tissue
// is not solved to equilibrium within a tick. A wave may store energy in it that the hand has not paid for,
// and return it. So with tissue, kTissueShare of moved_J() is allowed besides. This allowance is measured for
// this engine, and is no theorem.
//
// outside. The proxy's centre is no nearer to a rigid object than the proxy's radius, within rounding.
class TickInvariants {
 public:
  static constexpr double kTissueShare = 0.005;  // share of moved_J()

  // Call when the session begins. `world` must outlive this object.
  TickInvariants(const World& world, const WorldState& state);

  // After each tick.
  void check_tick(const WorldState& state, const TickResult& felt, double dt_s);
  // Checks every displacement and pose; check_tick() does so for some ticks only.
  void check_state(const WorldState& state);

  [[nodiscard]] std::uint64_t ticks() const { return ticks_; }
  [[nodiscard]] std::uint64_t not_finite() const { return not_finite_; }
  [[nodiscard]] double most_N() const { return most_N_; }
  // Excess over the limits (N); 0 if within them.
  [[nodiscard]] double over_force_N() const { return over_force_N_; }
  [[nodiscard]] double over_slew_N() const { return over_slew_N_; }
  // The largest excess of given plus stored energy over the allowed energy (J), and its bound. The bound is
  // for rounding and, with tissue, for kTissueShare.
  [[nodiscard]] double excess_J() const { return excess_J_; }
  [[nodiscard]] double tolerance_J() const;
  // Sum over the ticks of the absolute work and of the coupling's stored energy.
  [[nodiscard]] double moved_J() const { return moved_J_; }
  [[nodiscard]] double given_J() const { return given_J_; }  // work on the hand, summed over all ticks
  // The largest value of given_J() so far, and the largest work of a single tick. They serve to compare runs
  // with and without a passivity controller.
  [[nodiscard]] double most_given_J() const { return most_given_J_; }
  [[nodiscard]] double worst_tick_J() const { return worst_tick_J_; }
  [[nodiscard]] double allowed_J() const { return allowed_J_; }  // summed over all ticks
  // Largest depth of the proxy's ball in a rigid object (m).
  [[nodiscard]] double inside_m() const { return inside_m_; }
  [[nodiscard]] double slowest_us() const { return slowest_us_; }
  [[nodiscard]] std::uint64_t hash() const { return hash_; }

 private:
  void account_energy(const WorldState& state, const TickResult& felt);
  void check_outside(const WorldState& state, const glm::dvec3& proxy);

  const World& world_;
  std::uint64_t ticks_ = 0, not_finite_ = 0, hash_;
  double most_N_ = 0.0, over_force_N_ = 0.0, over_slew_N_ = 0.0, inside_m_ = 0.0, slowest_us_ = 0.0;
  double most_given_J_ = 0.0, worst_tick_J_ = 0.0;
  double given_J_ = 0.0, allowed_J_ = 0.0, excess_J_ = 0.0, moved_J_ = 0.0, stored_J_ = 0.0;
  glm::dvec3 force_N_{0.0}, device_m_{0.0};
  double slewed_N_ = 0.0;  // distance of the force from the clamped force
};

}  // namespace hybrid
