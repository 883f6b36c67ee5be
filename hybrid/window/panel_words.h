// SPDX-License-Identifier: GPL-3.0-or-later
// Words of the panel. Uses no graphics library.
#pragma once

#include <string>
#include <vector>

#include "hybrid/snapshot/snapshot.h"

namespace hybrid {

// The name of an object, or of the tool (Edit::kTool).
[[nodiscard]] std::string object_name(const DrawnScene& scene, std::uint32_t object);
// The format of a slider's number: three digits at least, and never an exponent for a large number.
[[nodiscard]] std::string number_format(float shown);
// For example "85.2 µs" or "1.23 ms".
[[nodiscard]] std::string tick_time_text(double us);
[[nodiscard]] std::string words_of_value(EditedQuantity quantity, bool of_tool);

// A model of tissue that may be compared with another one: the scene after these changes.
struct ModelOption {
  std::string words{};
  std::vector<SceneChange> changes{};
};
// The tissue as it is comes first. Then those that differ in one thing: energy, spacing (finer ones first),
// or rigid.
[[nodiscard]] std::vector<ModelOption> model_options(const DrawnObject& tissue);

}  // namespace hybrid
