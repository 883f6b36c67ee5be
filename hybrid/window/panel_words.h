// SPDX-License-Identifier: GPL-3.0-or-later
// Words of the panel. Uses no graphics library.
#pragma once

#include <string>

#include "hybrid/snapshot/snapshot.h"

namespace hybrid {

// The name of an object, or of the tool (Edit::kTool).
[[nodiscard]] std::string object_name(const DrawnScene& scene, std::uint32_t object);
// The format of a slider's number: three digits at least, and never an exponent for a large number.
[[nodiscard]] std::string number_format(float shown);
[[nodiscard]] std::string words_of_value(EditedQuantity quantity);

}  // namespace hybrid
