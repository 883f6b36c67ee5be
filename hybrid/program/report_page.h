// SPDX-License-Identifier: GPL-3.0-or-later
// `--report DIR`: parts that the pages of all commands share.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "hybrid/page/page.h"
#include "hybrid/program/commands.h"
#include "hybrid/session/outputs.h"

namespace hybrid {

// The command line for a shell. Words that a shell would read differently are quoted.
std::string command_line(int count, const char* const* words);

// Refuses, before the work, a folder that cannot be written.
void ask_report(Outputs& outputs, const ReportRequest& request);

// Adds the entries at the end of a page, and writes the page. `report` must begin with report_head().
void write_report(Outputs& outputs, const ReportRequest& request, Page page,
                  const nlohmann::ordered_json& report);

}  // namespace hybrid
