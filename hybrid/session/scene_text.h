// SPDX-License-Identifier: GPL-3.0-or-later
// Edited values written into the text of a scene: only the values change, and comments and layout stay.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "hybrid/world/edits.h"

namespace hybrid {

struct ValueInScene {
  std::string object;  // name of a rigid object; empty: the tool
  EditedQuantity quantity = EditedQuantity::coupling_stiffness;
  double value = 0.0, in_scene = 0.0;  // SI units; value now, and value in the scene
};

struct EditedText {
  std::string text;
  std::vector<std::string> changed;  // "tool: stiffness", …
  std::vector<std::string> left;     // as in `changed`, with the reason why they were not written
};

// Returns the text with every value that differs from the scene's. A key that the scene lacks is added below
// the header of its table. Two kinds of value are not written: those of objects without a named [[rigid]]
// table, and stiffness factors of tissue, because objects may share a material. `unit_m`: length unit of the
// scene's numbers. `file` is used in messages. Throws SceneError if `text` is no TOML.
[[nodiscard]] EditedText write_values(const std::string& text, const std::filesystem::path& file,
                                      double unit_m, std::span<const ValueInScene> values);

}  // namespace hybrid
