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

// Whether the passes of two settings overlap, so that the machine's noise hides which one is cheaper.
bool cost_overlaps(const TunedSetting& a, const TunedSetting& b);

}  // namespace hybrid
