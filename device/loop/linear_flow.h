// SPDX-License-Identifier: GPL-3.0-or-later
// Exact motion of a mass on a spring and a damper over a given time.
#pragma once

namespace device {

// The solution of m·y'' + d·y' + k·y = F after `time_s`, for constant F:
//   y(t) = y(0) + from_velocity_s · y'(0) + from_acceleration_s2 · a,
//   y'(t) = velocity_factor · y'(0) + from_velocity_s · a,
// with a = (F − k·y(0)) / m. The coefficients follow from the impulse response g:
//   g'' + (d/m)·g' + (k/m)·g = 0, g(0) = 0, g'(0) = 1.
// The formulas give the change of y instead of y itself, so that a small change keeps its digits.
struct LinearFlow {
  double time_s = -1.0;
  double from_velocity_s = 0.0;       // g at time_s
  double velocity_factor = 1.0;       // g' at time_s
  double from_acceleration_s2 = 0.0;  // integral of g from 0 to time_s
};

// Needs mass > 0, damping >= 0, stiffness >= 0 and a finite time >= 0. The relative error is below 1e-12 for
// values of any size (tests/device/loop/test_linear_flow.cpp).
LinearFlow linear_flow(double mass_kg, double damping_N_s_per_m, double stiffness_N_per_m,
                       double time_s) noexcept;

}  // namespace device
