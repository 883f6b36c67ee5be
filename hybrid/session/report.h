// SPDX-License-Identifier: GPL-3.0-or-later
// Reports as JSON (keys are stable, more may be added) and as words.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "hybrid/session/session.h"

namespace hybrid {

// The first entries of every report: command, version, machine.
nlohmann::ordered_json report_head(const std::string& command);
nlohmann::ordered_json to_json(const Percentiles& p);
// "p50/p99/p99.9/max", without decimals.
std::string in_words(const Percentiles& p);
nlohmann::ordered_json run_report(const Scene& scene, const BuiltScene& built, SessionResult& result);

// The same report as text for a person to read.
std::string run_summary(const BuiltScene& built, SessionResult& result);

// Texts of the faults that are set, each with its remedy where there is one. Empty when none is set.
std::vector<std::string> fault_texts(std::uint32_t faults);

// Writes to a file, or to standard output for "-". Throws std::runtime_error: not writable.
void save_json(const std::string& file, const nlohmann::ordered_json& report);

}  // namespace hybrid
