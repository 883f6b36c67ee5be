// SPDX-License-Identifier: GPL-3.0-or-later
// The figure of `hybrid bench occupancy`.
#pragma once

#include <filesystem>
#include <vector>

#include "hybrid/bench/occupancy.h"

namespace hybrid {

// Look-up time over occupied cells, both axes logarithmic. Throws std::runtime_error if the file is not
// writable.
void save_occupancy_plot(const std::filesystem::path& svg, const std::vector<bench::OccupancyRow>& rows);

}  // namespace hybrid
