// SPDX-License-Identifier: GPL-3.0-or-later
// A ball on tissue that is much larger than the contact.
#pragma once

#include "hybrid/scene/scene.h"

namespace hybrid {

// Hertz 1882, F = 4/3·E/(1−ν²)·√R·d^1.5, for a half-space (N).
double hertz_N(double young_Pa, double poisson, double radius_m, double depth_m);

// Force on a layer bonded to a rigid base, relative to Hertz, to the third order in `share` = √(R·d) /
// thickness. Up to 0.3 the fourth order is below 0.1 %. Dimitriadis, Horkay, Maresca, Kachar, Chadwick,
// Biophys. J. 82 (2002) 2798, equation 12.
double bonded_layer_factor(double poisson, double share);

// The program's force of a ball on a half-space, relative to Hertz. It is measured on a block as deep as ten
// contact radii and twice as wide, of which the contact radius has `nodes` spacings, and divided by
// bonded_layer_factor().
double half_space_factor(Energy energy, double poisson, double depth_per_radius, int nodes);

}  // namespace hybrid
