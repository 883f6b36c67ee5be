// SPDX-License-Identifier: GPL-3.0-or-later
// Error over the tick's p99.9 of all settings, both logarithmic.
#pragma once

#include <filesystem>
#include <string>

#include "hybrid/tune/tune.h"

namespace hybrid {

// The front is joined, the chosen setting is marked, dominated ones are grey; the area of a mark grows with
// its memory. Lines show the error's bound and the budget. Throws std::runtime_error: not writable.
void save_tune_plot(const std::filesystem::path& svg, const TuneResult& result, const std::string& title);

}  // namespace hybrid
