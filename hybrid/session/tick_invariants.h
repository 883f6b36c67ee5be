// SPDX-License-Identifier: GPL-3.0-or-later
// Watches ticks from outside for what must hold of every one of them, whatever the scene and the input.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <string>

#include "hybrid/tick/tick.h"

namespace hybrid {

// What must hold:
//
// finite. Every number that a tick gives out, and every one that it keeps (proxy, poses, displacements), is.
//
// limits. The force is no longer than ForceLimits::max_force_N, and changes by no more than max_slew_N_per_s
// times the tick, but to zero.
//
// energy. Of rigid objects that stay and have no friction, damping or texture, and of tissue. What coupling
// and tissue store as the watch begins may be given to the hand. Let U(x) be the least energy of the coupling
// (and of the tissue) that the proxy can reach from where it is when the device is at x. The proxy of the
// tick before can stay, so the new energy is at most
//     U' <= ½K|x' − q|² = U − F·(x' − x) + ½K|x' − x|²,    F = K (q − x) the force,
// whatever the surface: the work F·(x' − x) that the held force does on the hand is what was stored, and no
// more than ½K|Δx|² a tick beside it. That much is what holding a force for a tick costs (Colgate & Schenkel
// 1997, K·T/2), and an engine that adds nothing of its own stays within it, stable or not: a coupling stiffer
// than the loop can hold buzzes on this share alone. With the clamp the same holds of the clamped spring's
// energy. A limit on the slew is a delay, and may give |ΔF|·|Δx| more, ΔF what it changed; so that is added
// to what is allowed, and is zero wherever the slew did not cut. Tissue is not solved to equilibrium within a
// tick: a wave may store in it what the hand has not paid for, and give it back. With tissue, kTissueShare of
// all the work that went to and fro is let pass; that bounds this engine's error, and is no theorem.
//
// outside. The proxy's ball is not in a rigid object, nor nearer than its radius, but for rounding.
class TickWatch {
 public:
  static constexpr double kTissueShare = 0.005;

  // Both as a session begins. `world` is to outlive the watch.
  TickWatch(const World& world, const WorldState& state);

  // After each tick.
  void see(const WorldState& state, const TickResult& felt, double dt_s);
  // Every displacement and pose; see() looks at them now and then.
  void see_all(const WorldState& state);

  [[nodiscard]] std::uint64_t ticks() const { return ticks_; }
  [[nodiscard]] std::uint64_t not_finite() const { return not_finite_; }
  [[nodiscard]] double most_N() const { return most_N_; }
  // Beyond the limits (N); 0: within.
  [[nodiscard]] double over_force_N() const { return over_force_N_; }
  [[nodiscard]] double over_slew_N() const { return over_slew_N_; }
  // The most by which what was given to the hand and is stored still exceeded what is allowed (J), and what
  // that is to be compared with: rounding, and the tissue's share.
  [[nodiscard]] double excess_J() const { return excess_J_; }
  [[nodiscard]] double tolerance_J() const;
  [[nodiscard]] double moved_J() const { return moved_J_; }  // to and fro
  [[nodiscard]] double given_J() const { return given_J_; }  // to the hand, by the end
  // The most that was ever given, and the largest work of any one tick: what a passivity controller compares.
  [[nodiscard]] double most_given_J() const { return most_given_J_; }
  [[nodiscard]] double worst_tick_J() const { return worst_tick_J_; }
  [[nodiscard]] double allowed_J() const { return allowed_J_; }  // by the end
  // The most by which the proxy's ball was in something rigid (m).
  [[nodiscard]] double inside_m() const { return inside_m_; }
  [[nodiscard]] double slowest_us() const { return slowest_us_; }
  [[nodiscard]] std::uint64_t hash() const { return hash_; }

 private:
  void account(const TickResult& felt);
  void look_outside(const WorldState& state, const glm::dvec3& proxy);

  const World& world_;
  std::uint64_t ticks_ = 0, not_finite_ = 0, hash_;
  double most_N_ = 0.0, over_force_N_ = 0.0, over_slew_N_ = 0.0, inside_m_ = 0.0, slowest_us_ = 0.0;
  double most_given_J_ = 0.0, worst_tick_J_ = 0.0;
  double given_J_ = 0.0, allowed_J_ = 0.0, excess_J_ = 0.0, moved_J_ = 0.0, stored_J_ = 0.0;
  glm::dvec3 force_N_{0.0}, device_m_{0.0};
  double slewed_N_ = 0.0;  // how far the force was from the clamped one
};

}  // namespace hybrid
