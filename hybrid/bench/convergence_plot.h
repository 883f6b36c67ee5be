// SPDX-License-Identifier: GPL-3.0-or-later
// The thesis's Figure 22 as SVG: relaxation that oscillates, and relaxation that settles.
#pragma once

#include <filesystem>
#include <vector>

#include "hybrid/bench/soft_convergence.h"

namespace hybrid {

// Throws std::runtime_error if the file is not writable.
void save_settling_plot(const std::filesystem::path& svg, const std::vector<bench::SettlingObject>& objects);

}  // namespace hybrid
