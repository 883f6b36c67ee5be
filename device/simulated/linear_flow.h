// SPDX-License-Identifier: GPL-3.0-or-later
// What mass, spring and damper do in a given time, exactly.
#pragma once

namespace device {

// The solution of m·y'' + d·y' + k·y = F after `time_s`, for constant F:
//   y(t) = y(0) + from_speed_s · y'(0) + from_pull_s2 · a,     y'(t) = keep · y'(0) + from_speed_s · a,
// with a = (F − k·y(0)) / m. All three follow from the impulse response g, g'' + (d/m)·g' + (k/m)·g = 0,
// g(0) = 0, g'(0) = 1. The change of y, not y itself, is what is given: it loses nothing to rounding where
// little changes.
struct LinearFlow {
  double time_s = -1.0;
  double from_speed_s = 0.0;  // g
  double keep = 1.0;          // g'
  double from_pull_s2 = 0.0;  // ∫ g
};

// For mass > 0, damping >= 0, stiffness >= 0 and a finite time >= 0: relative error below 1e-12, whatever
// their size (tests/device/simulated/test_linear_flow.cpp).
LinearFlow linear_flow(double mass_kg, double damping_N_s_per_m, double stiffness_N_per_m,
                       double time_s) noexcept;

}  // namespace device
