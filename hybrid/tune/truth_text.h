// SPDX-License-Identifier: GPL-3.0-or-later
// A truth and its error in words and as JSON, the same in all reports.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "hybrid/tune/truth.h"

namespace hybrid {

// For example "0.81 JND moving, 0.51 still"; p99.
std::string in_words(const SettingError& error);
// The truth with its own error, then the errors from the scene's spacing and from its shapes.
std::string truth_words(const Truth& truth);

nlohmann::ordered_json to_json(const SettingError& error);
nlohmann::ordered_json to_json(const Truth& truth);

}  // namespace hybrid
