// SPDX-License-Identifier: GPL-3.0-or-later
// Soft objects as the thesis felt them (voxel/baseline/thesis_chainmail.h), without a proxy: for comparison only.
#pragma once

#include <vector>

#include "hybrid/compare/compare.h"

namespace hybrid {

// The soft object along the device positions of `like`: each tick the six-direction check, the chain, the
// force of the lines through the touched element, and relaxation of as many elements as the object's budget
// says, damped as the thesis has it in the end (which is part of the tick's time, as it is for `voxels`).
// What is felt is that force itself: there is no coupling. Throws std::exception in words.
ModelResult classic_voxels(const Scene& scene, const SoftDescription& soft,
                           const std::vector<TraceRow>& like);

}  // namespace hybrid
