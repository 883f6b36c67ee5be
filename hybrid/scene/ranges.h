// SPDX-License-Identifier: GPL-3.0-or-later
// Ranges of scene values that may also be edited while a session runs.
#pragma once

namespace hybrid {

struct AllowedRange {
  double low = 0.0, high = 0.0;
  [[nodiscard]] constexpr bool has(double value) const noexcept {  // false for NaN
    return value >= low && value <= high;
  }
};

// Stiffness of the coupling; greatest force; friction coefficients; damping of a surface.
inline constexpr AllowedRange kCouplingRange_N_per_m{1e-6, 1e9};
inline constexpr AllowedRange kMaxForceRange_N{1e-6, 1e4};
inline constexpr AllowedRange kFrictionRange{0.0, 10.0};
inline constexpr AllowedRange kDampingRange_N_s_per_m{0.0, 1e4};
inline constexpr double kSmallestSize_m = 1e-9;  // of lengths and heights
// Largest height of a texture (unit: its period). Steeper flanks would be walls that a tool cannot slide
// over.
inline constexpr double kMostTextureHeight = 0.5;

}  // namespace hybrid
