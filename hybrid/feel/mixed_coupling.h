// SPDX-License-Identifier: GPL-3.0-or-later
// The virtual coupling where objects have stiffnesses of their own.
//
// The coupling is a spring between device and proxy. Its stiffness follows the object that the proxy touches.
// If the stiffness of a pressed spring grew freely, the hand would gain energy: press on a soft object, slide
// over to a stiff one, and let go there. So the energy that the hand has given is accounted, and the spring
// never stores more. Where the energy is short, the force is less than stiffness · depth; its slope over
// depth is still the stiffness. Energy that a softer spring cannot store serves when the stiffness grows
// again.
#pragma once

#include <span>

namespace hybrid {

struct MixedCoupling {
  double stiffness_N_per_m = 0.0;  // slope of the force over depth; 0: the proxy is at the device
  double depth_m = 0.0, force_N = 0.0;
  // Energy that the hand gave since the contact began and did not get back; at least the spring's.
  double energy_J = 0.0;
  double force_per_depth_N_per_m = 0.0;  // > 0 in contact

  [[nodiscard]] bool pressed() const noexcept { return stiffness_N_per_m > 0.0; }
};

// Stiffness of the coupling with one object, and the object's share of the force on the proxy (N).
struct ObjectStiffness {
  double stiffness_N_per_m = 0.0, force_N = 0.0;
};
// The mean, weighted by the forces; `otherwise` if there are none.
double mean_stiffness(std::span<const ObjectStiffness> objects, double otherwise_N_per_m) noexcept;

// Time in which the stiffness changes by that of the stiffest object. The force is then continuous where the
// proxy passes from one object to another. In a tick of 1 ms it changes by at most 5 % of the stiffest
// object's force, and a hand tells 7 %.
inline constexpr double kStiffnessChange_s = 0.02;

// Call in every tick, after the proxy has moved. `depth_m`: distance from the device to the proxy.
// `stiffest`: of all objects. A new contact has the stiffness `wanted` at once. In a lasting contact the
// stiffness approaches `wanted` at a constant rate.
void update(MixedCoupling& coupling, double depth_m, double wanted_N_per_m, double stiffest_N_per_m,
            double dt_s) noexcept;

}  // namespace hybrid
