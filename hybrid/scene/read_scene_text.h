// SPDX-License-Identifier: GPL-3.0-or-later
// Reads a scene that is not on disk.
#pragma once

#include <filesystem>
#include <string_view>

#include "hybrid/scene/scene.h"

namespace hybrid {

// Name, in errors, of a scene that was given as text.
inline constexpr const char* kNameOfText = "<text>";

// Like read_scene(), for text in memory. Files of the scene are relative to the folder of `file`, and errors
// name `file`. `file` need not exist.
[[nodiscard]] Scene read_scene_text(std::string_view text, const std::filesystem::path& file);

}  // namespace hybrid
