// SPDX-License-Identifier: GPL-3.0-or-later
// Writes a setting into the text of a scene. Only the values' own characters change, and keys that are
// missing are added; comments, order and layout stay.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "hybrid/tune/setting.h"

namespace hybrid {

// The line that gives the reason begins with this. One that stands there already is replaced.
inline constexpr std::string_view kReasonMark = "# hybrid tune: ";

// The text of a scene file with the setting in it, and `reason`, one sentence, in a comment above each object
// that changed. Values that are as the scene has them are left as they are written. The result has been
// parsed again: it has the setting's values, and all others are as they were. `file` is named in messages
// only. Throws SceneError: the text is no scene. Throws std::runtime_error: it cannot be edited, with what to
// write.
std::string edited_scene(std::string_view text, const std::filesystem::path& file,
                         const std::vector<TunableObject>& objects, const Setting& setting,
                         const std::string& reason);

}  // namespace hybrid
