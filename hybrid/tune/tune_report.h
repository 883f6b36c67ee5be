// SPDX-License-Identifier: GPL-3.0-or-later
// The result of a search in words, as a table, and as a report.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "hybrid/tune/tune.h"

namespace hybrid {

// The choice and its reason in one sentence.
std::string tune_verdict(const TuneResult& result);
// The reason as a comment for the scene's file: one sentence without line breaks.
std::string tune_reason(const TuneResult& result);
// How to read the errors, the truth, the confirmation and the notes; a line each.
std::string tune_legend(const TuneResult& result);
// The verdict, the front, the settings that were left out, and the legend; several lines.
std::string tune_words(const TuneResult& result);
// Keys of `hybrid tune --json`, to be added to report_head().
nlohmann::ordered_json tune_json(const TuneResult& result);

// Does the machine's noise hide which of two settings is cheaper? It does if their p99.9 has one order in
// more than a quarter of the passes and the other order in more than a quarter, too. The settings are played
// in turns.
bool cost_hidden(const TunedSetting& a, const TunedSetting& b);

}  // namespace hybrid
