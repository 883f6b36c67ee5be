// SPDX-License-Identifier: GPL-3.0-or-later
// Processor time of the threads (the thesis's Table 5).
#pragma once

#include <string>
#include <vector>

#include "hybrid/bench/thesis/thesis_study.h"

namespace hybrid::bench {

// Plays the scene twice: as it is, and with its soft objects voxel by voxel. The relaxation of objects on
// nested patches is part of the tick. Frames are drawn at 30 Hz without a display. `no_graphics`: why they
// were not drawn.
std::vector<ThreadShare> thread_shares(const Scene& scene, double seconds, std::string& no_graphics);

}  // namespace hybrid::bench
