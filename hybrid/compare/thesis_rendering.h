// SPDX-License-Identifier: GPL-3.0-or-later
// Soft objects as the thesis rendered them (voxel/baseline/thesis_chainmail.h), without a proxy. For
// comparison only.
#pragma once

#include <vector>

#include "hybrid/compare/compare.h"

namespace hybrid {

// Factor on the movement in the thesis's relaxation; 1: undamped. The thesis: "some small value".
inline constexpr double kThesisDamping = 0.5;

// Plays the soft object along the device positions of `like`. Each tick has the six-direction check, the
// chain, the force of the lines through the touched element, and relaxation of as many elements as the
// object's budget says. Relaxation is damped as in the thesis's final version. The tick's time includes that
// of relaxation, as it does for model "voxels". There is no coupling: the result is the force of the tissue
// itself. Throws std::exception with a message for people.
ModelResult classic_voxels(const Scene& scene, const SoftDescription& soft,
                           const std::vector<TraceRow>& like);

}  // namespace hybrid
