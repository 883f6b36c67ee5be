// SPDX-License-Identifier: GPL-3.0-or-later
// Plot of all settings: error over the p99.9 of the tick, both axes logarithmic.
#pragma once

#include <string>

#include "hybrid/tune/tune.h"

namespace hybrid {

// The settings of the front are joined by a line, the chosen one is marked, and dominated ones are grey. The
// area of a mark grows with the memory. Lines show the error's bound and the budget. The text of an SVG file.
std::string tune_svg(const TuneResult& result, const std::string& title);

}  // namespace hybrid
