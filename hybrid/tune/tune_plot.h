// SPDX-License-Identifier: GPL-3.0-or-later
// Plot of all settings: error over the p99.9 of the tick, both axes logarithmic.
#pragma once

#include <filesystem>
#include <string>

#include "hybrid/tune/tune.h"

namespace hybrid {

// The settings of the front are joined by a line, the chosen one is marked, and dominated ones are grey. The
// area of a mark grows with the memory. Lines show the error's bound and the budget. Throws
// std::runtime_error if the file is not writable.
void save_tune_plot(const std::filesystem::path& svg, const TuneResult& result, const std::string& title);

}  // namespace hybrid
