// SPDX-License-Identifier: GPL-3.0-or-later
// The result of models_in_scene() in words, as JSON, and as a figure.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "hybrid/models/models_in_scene.h"
#include "hybrid/plot/svg_figure.h"

namespace hybrid {

// By which of its figures a hand tells the model from the reference, in words: "force", "direction",
// "stiffness" (more than kStiffnessJndTool), "stiffness (finger)" (more than kStiffnessJndFinger). Empty: by
// none.
std::vector<std::string> told_apart_by(const ModelRow& row, const ObjectModels& object);

// Index of the row with the least p99.9 of the tick among those that a hand with a tool cannot tell from the
// reference. The scene as given is kept if no other is clearly cheaper. Empty: a hand tells all.
std::optional<std::size_t> cheapest_untold(const ObjectModels& object);

// The result for one object in a few sentences, the most important one first.
std::string models_verdict(const ModelsInScene& models, const ObjectModels& object);

std::string models_words(const ModelsInScene& models);
nlohmann::ordered_json models_json(const ModelsInScene& models);
// For each object: forces and differences from the reference over time, and force over depth.
Figure models_figure(const ModelsInScene& models, const std::string& title);

}  // namespace hybrid
