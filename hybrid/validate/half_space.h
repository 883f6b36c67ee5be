// SPDX-License-Identifier: GPL-3.0-or-later
// Force of a ball on tissue that is much larger than the contact.
#pragma once

#include "hybrid/scene/scene.h"

namespace hybrid {

// Force of a ball on a half-space (N): Hertz 1882, F = 4/3·E/(1−ν²)·√R·d^1.5.
double hertz_N(double young_Pa, double poisson, double radius_m, double depth_m);

// Force on a layer that is bonded to a rigid base, relative to Hertz, to the third order in `share` = √(R·d)
// / thickness. For shares up to 0.3 the fourth order is below 0.1 %. Dimitriadis, Horkay, Maresca, Kachar,
// Chadwick, Biophys. J. 82 (2002) 2798, equation 12.
double bonded_layer_factor(double poisson, double share);

// The program's force of a ball on a half-space, relative to Hertz. It is measured on a block that is ten
// contact radii deep and twenty wide, and divided by bonded_layer_factor(). The contact radius has `nodes`
// spacings.
double half_space_factor(Energy energy, double poisson, double depth_per_radius, int nodes);

}  // namespace hybrid
