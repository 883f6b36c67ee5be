// SPDX-License-Identifier: GPL-3.0-or-later
// The measurements of stability as JSON and as text for a person.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "hybrid/stability/stability.h"

namespace hybrid {

// {scene, seconds, agreement{stable{rows, worst_error}, passive{…}}, rows_below_bound, rows[…]}
void add_to_json(const StabilityReport& report, nlohmann::ordered_json& json);

// One table for each sweep, with its result in one line.
std::string stability_tables(const StabilityReport& report);

}  // namespace hybrid
