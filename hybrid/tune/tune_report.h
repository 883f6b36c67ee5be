// SPDX-License-Identifier: GPL-3.0-or-later
// The result of a search in words, as a table, and as a report.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "hybrid/tune/tune.h"

namespace hybrid {

// The choice and its reason in one sentence.
std::string tune_verdict(const TuneResult& result);
// The reason for the scene's file, one sentence without line breaks.
std::string tune_reason(const TuneResult& result);
// The truth, the front, what was left out, and the confirmation; several lines.
std::string tune_words(const TuneResult& result);
// Keys of `hybrid tune --json`, to be added to report_head().
nlohmann::ordered_json tune_json(const TuneResult& result);

// Whether the machine's noise hides which of two settings is cheaper: in more than a quarter of the passes,
// which are played in turns, the order of their p99.9 is another one.
bool cost_hidden(const TunedSetting& a, const TunedSetting& b);

}  // namespace hybrid
