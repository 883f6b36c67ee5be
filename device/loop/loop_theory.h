// SPDX-License-Identifier: GPL-3.0-or-later
// Theory of a virtual wall in a sampled loop: the largest stiffness for which the loop is stable, and the
// largest for which it is passive. As in the program's loop, the position is sampled every period T, and the
// wall's force is
//   u = −K·x − B·(x(k) − x(k−1))/T.
// The motors apply this force `delay_ticks` periods later, and hold it for one period (zero-order hold).
#pragma once

namespace device {

struct SampledLoop {
  double mass_kg = 0.1;                 // mechanism and hand; > 0
  double damping_N_s_per_m = 1.0;       // b, viscous: mechanism alone; for stability with the hand
  double hand_stiffness_N_per_m = 0.0;  // spring of the hand, about its target
  double wall_damping_N_s_per_m = 0.0;  // B of the wall
  double period_s = 1e-3;               // T; > 0
  int delay_ticks = 0;                  // from sample to force, in whole periods
};

// ---- stability: the eigenvalues of the sampled linear loop

// Spectral radius of the map over one period, with the tool in contact with the wall throughout. Below 1
// every motion decays; above 1 some motion grows by this factor per period. The mechanics are sampled exactly
// (matrix exponential). Forces that wait for the motors are part of the state.
[[nodiscard]] double spectral_radius(const SampledLoop& loop, double stiffness_N_per_m);

// The smallest K at which the loop becomes unstable (N/m), to a relative 1e-9. Returns 0 if the loop is
// unstable even for K = 1e-6·m/T². The cause is then a B that is too large for m and T.
[[nodiscard]] double largest_stable_stiffness(const SampledLoop& loop);

// ---- passivity

// Colgate & Schenkel, "Passivity of a class of sampled-data systems" (1997). The wall
// H(z) = (K + B·(1 − z⁻¹)/T)·z^(−delay) gives no energy to any passive operator that is coupled to it if
//   b >= max over θ of T/2 · Re{(1 − z⁻¹)·H(z)} / (1 − cos θ),  z = e^{iθ}, 0 < θ <= π.
// Returns the right side (N·s/m). Its closed form is K·T/2 + |B| without delay, and (2·delay + 1)·K·T/2 for
// B = 0.
[[nodiscard]] double passive_damping(const SampledLoop& loop, double stiffness_N_per_m);

// The expression under the maximum at one θ: a motion that is sampled as a sinusoid of phase θ per period.
[[nodiscard]] double passive_damping_at(const SampledLoop& loop, double stiffness_N_per_m, double theta_rad);

// The largest K for which loop.damping_N_s_per_m suffices (N/m), to a relative 1e-6; 0 if B alone exceeds it.
// Independent of mass and hand.
[[nodiscard]] double largest_passive_stiffness(const SampledLoop& loop);

// Abbott & Okamura, "Effects of position quantization and sampling rate on virtual-wall passivity" (2005).
// With Coulomb friction f_c and an encoder step Δ, a wall without damping or delay is passive up to the
// smaller of 2b/T and 2·f_c/Δ (N/m). Friction dissipates only the energy that the encoder step creates, not
// that of the sampling. Without an encoder step the bound is 2b/T.
[[nodiscard]] double friction_and_quantisation_bound(double damping_N_s_per_m, double period_s,
                                                     double friction_N, double quantisation_m);

}  // namespace device
