// SPDX-License-Identifier: GPL-3.0-or-later
// What was measured of stability, as JSON and as a person would read it.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "hybrid/stability/stability.h"

namespace hybrid {

// {scene, seconds, agreement{stable{rows, worst_error}, passive{…}}, rows_below_bound, rows[…]}
void add_to_json(const StabilityReport& report, nlohmann::ordered_json& json);

// Tables, one a sweep, and what they say in one line each.
std::string stability_tables(const StabilityReport& report);

}  // namespace hybrid
