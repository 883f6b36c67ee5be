// SPDX-License-Identifier: GPL-3.0-or-later
// Options that are spelled outside main.cpp.
#pragma once

#include <CLI/App.hpp>
#include <string>

#include "hybrid/program/commands.h"

namespace hybrid {

// The command line as it was typed. main() sets it once, before the options are added.
std::string& typed_command();

// The option --report.
void add_report(CLI::App& sub, ReportRequest& report);

// The commands `compare` and `study`. Each writes its exit status into `status` when it runs.
void add_compare(CLI::App& app, int& status);
void add_study(CLI::App& app, int& status);

// Options of `compose` that select labels and intensities of tissue: --names, --rigid, --soft, --range,
// --spacing. The first three need `labels`.
void add_tissue_options(CLI::App& sub, ComposeOptions& options, CLI::Option* labels);

}  // namespace hybrid
