// SPDX-License-Identifier: GPL-3.0-or-later
// The names of a soft object's materials, as pictures, plots and reports show them.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "hybrid/scene/scene.h"
#include "hybrid/world/world.h"

namespace hybrid {

inline constexpr const char* kUnnamed = "default material";  // name for labels whose material is not named

// The material of each label, as a number and by name.
struct MaterialsOfLabels {
  std::array<std::uint8_t, 256> of_label{};
  std::vector<std::string> names;
};
[[nodiscard]] MaterialsOfLabels materials_of_labels(const SoftDescription& description, const SoftBody& body);

}  // namespace hybrid
