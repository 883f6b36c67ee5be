// SPDX-License-Identifier: GPL-3.0-or-later
// Figure 22: relaxation that oscillates and relaxation that settles, as SVG.
#pragma once

#include <filesystem>
#include <vector>

#include "hybrid/bench/soft_convergence.h"

namespace hybrid {

// Throws std::runtime_error: file not writable.
void save_settling_plot(const std::filesystem::path& svg, const std::vector<bench::SettlingObject>& objects);

}  // namespace hybrid
