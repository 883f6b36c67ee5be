// SPDX-License-Identifier: GPL-3.0-or-later
// Writes a setting into the text of a scene. Only values change, and missing keys are added. Comments, order
// and layout stay.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "hybrid/tune/setting.h"

namespace hybrid {

// A line with the reason begins with this mark. Lines that already begin with it are replaced.
inline constexpr std::string_view kReasonMark = "# hybrid tune: ";

// Returns the text of a scene file with the setting in it. A comment above the keys of each table that
// changed gives `reason`, which is one sentence, behind `mark`. Values that do not differ from the scene's
// keep their text. The result has been parsed again: it has the values of the setting, and all other values
// are as before. `file` is used only in messages. Throws SceneError: the text is no scene. Throws
// std::runtime_error with the lines to write by hand: the text cannot be edited.
std::string edited_scene(std::string_view text, const std::filesystem::path& file,
                         const std::vector<TunableObject>& objects, const Setting& setting,
                         const std::string& reason, std::string_view mark = kReasonMark);

}  // namespace hybrid
