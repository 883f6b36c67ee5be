// SPDX-License-Identifier: GPL-3.0-or-later
// Soft objects as the thesis rendered them (voxel/baseline/thesis_chainmail.h), without a proxy. For
// comparison only.
#pragma once

#include <vector>

#include "hybrid/compare/compare.h"

namespace hybrid {

// Plays the soft object along the device positions of `like`. Each tick has the six-direction check, the
// chain, the force of the lines through the touched element, and relaxation of as many elements as the
// object's budget says. Relaxation is damped as in the thesis's final version. Its time is part of the tick's
// time, as it is for `voxels`. The result is this force itself: there is no coupling. Throws std::exception
// in words.
ModelResult classic_voxels(const Scene& scene, const SoftDescription& soft,
                           const std::vector<TraceRow>& like);

}  // namespace hybrid
