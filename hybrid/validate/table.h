// SPDX-License-Identifier: GPL-3.0-or-later
// The report of `hybrid validate` as JSON, as text for a terminal, and as a page.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "hybrid/page/page.h"
#include "hybrid/validate/validate.h"

namespace hybrid {

void add_to_json(const ValidationReport& report, nlohmann::ordered_json& json);
std::string validation_table(const ValidationReport& report);
Page validation_page(const ValidationReport& report, bool quick);

}  // namespace hybrid
