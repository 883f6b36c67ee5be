// SPDX-License-Identifier: GPL-3.0-or-later
// Spacing and material of the objects in the tests of CompositeGrid.
#pragma once

#include "voxel/lattice/lattice.h"

namespace tests {

inline constexpr double kSpacing = 1e-3;  // (m)

// A material whose links may stretch, shorten and shear by `play` times the spacing.
inline voxel::LinkMaterial slack(double play) {
  return {
      .young_Pa = 1e4, .poisson = 0.3, .stretch_min = 1.0 - play, .stretch_max = 1.0 + play, .shear = play};
}

}  // namespace tests
