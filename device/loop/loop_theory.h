// SPDX-License-Identifier: GPL-3.0-or-later
// What theory says of a virtual wall in a sampled loop: up to which stiffness it is stable, and up to which
// it is passive. The loop that is meant is the one the program runs: the position is sampled every period T,
// the wall answers u = −K·x − B·(x(k) − x(k−1))/T, and the motors hold that force, `delay_ticks` periods
// later, for one period (zero-order hold).
#pragma once

namespace device {

struct SampledLoop {
  double mass_kg = 0.1;                 // mechanism and hand; > 0
  double damping_N_s_per_m = 1.0;       // b, viscous: of the mechanism, and for stability also of the hand
  double hand_stiffness_N_per_m = 0.0;  // of the hand's spring, about its target
  double wall_damping_N_s_per_m = 0.0;  // B, of the wall, from the difference over one period
  double period_s = 1e-3;               // T; > 0
  int delay_ticks = 0;                  // from sample to force, in whole periods
};

// ---- stability: the eigenvalues of the sampled linear loop ----------------------------------------------

// The largest magnitude of an eigenvalue of one period's map, with the wall in contact throughout. Below 1
// every motion dies out, above 1 some motion grows by this factor a period. The mechanics are sampled exactly
// (matrix exponential), delayed forces are states of their own.
[[nodiscard]] double spectral_radius(const SampledLoop& loop, double stiffness_N_per_m);

// The least K at which the loop stops being stable (N/m), to a relative 1e-9; 0 when it is unstable already
// with almost no wall (1e-6·m/T²), as damping B above what m and T allow makes it.
[[nodiscard]] double largest_stable_stiffness(const SampledLoop& loop);

// ---- passivity ------------------------------------------------------------------------------------------

// Colgate & Schenkel, "Passivity of a class of sampled-data systems" (1997): whatever passive thing holds the
// device, no energy comes out of the wall H(z) = (K + B·(1 − z⁻¹)/T)·z^(−delay) while
//   b >= max over θ of T/2 · Re{(1 − z⁻¹)·H(z)} / (1 − cos θ),  z = e^{iθ}, 0 < θ <= π.
// Returns the right side (N·s/m). In closed form: K·T/2 + |B| without delay; (2·delay + 1)·K·T/2 for B = 0.
[[nodiscard]] double passive_damping(const SampledLoop& loop, double stiffness_N_per_m);

// The same at one θ: what the motion needs that is sampled as a sinusoid of this phase per period.
[[nodiscard]] double passive_damping_at(const SampledLoop& loop, double stiffness_N_per_m, double theta_rad);

// The largest K that loop.damping_N_s_per_m makes passive (N/m), to a relative 1e-6; 0 where B alone is too
// much. Mass and hand have no part in it.
[[nodiscard]] double largest_passive_stiffness(const SampledLoop& loop);

// Abbott & Okamura, "Effects of position quantization and sampling rate on virtual-wall passivity" (2005):
// with Coulomb friction f_c and an encoder step Δ a wall without damping or delay is passive up to
// min(2b/T, 2·f_c/Δ). Friction can make up for the encoder only, not for the sampling. With no encoder step
// 2b/T.
[[nodiscard]] double friction_and_quantisation_bound(double damping_N_s_per_m, double period_s,
                                                     double friction_N, double quantisation_m);

}  // namespace device
