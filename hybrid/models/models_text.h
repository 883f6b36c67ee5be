// SPDX-License-Identifier: GPL-3.0-or-later
// The result of models_in_scene() in words, as JSON, and as a figure.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "hybrid/models/models_in_scene.h"
#include "hybrid/plot/svg_figure.h"

namespace hybrid {

// Names of the figures whose error a hand feels: "force", "direction", "stiffness" (beyond
// kStiffnessJndTool), "stiffness (finger)" (beyond kStiffnessJndFinger). Empty: a hand feels no error.
std::vector<std::string> told_apart_by(const ModelRow& row, const ObjectModels& object);

// The cheapest of the rows that a hand with a tool cannot tell from the reference, by the p99.9 of the tick.
// Rows whose times can hardly be told from the least time count as equally cheap. Among these the scene as
// given comes first, then the most accurate row. Empty: a hand tells every row from the reference.
std::optional<std::size_t> cheapest_untold(const ObjectModels& object);

// The result for one object in a few sentences, the most important one first.
std::string models_verdict(const ModelsInScene& models, const ObjectModels& object);

std::string models_words(const ModelsInScene& models);
// The reference and its own error; the meaning of the figures; notes. A line has about one sentence.
std::string models_legend(const ModelsInScene& models);
// Relative error of the model's stiffness against the reference's. Empty if either has no stiffness.
std::optional<double> stiffness_off(const ModelRow& row, const ObjectModels& object);
// Delay of the model's onset after the reference's (ms). Empty if either is not felt.
std::optional<double> onset_later_ms(const ModelRow& row, const ObjectModels& object);
nlohmann::ordered_json models_json(const ModelsInScene& models);
// For each object: forces and differences from the reference over time, and force over depth.
Figure models_figure(const ModelsInScene& models, const std::string& title);

}  // namespace hybrid
