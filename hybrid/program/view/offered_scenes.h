// SPDX-License-Identifier: GPL-3.0-or-later
// The scenes that a window offers to open: those that come with the program, and those that were opened last.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "hybrid/window/panels.h"

namespace hybrid {

// The scenes in the folder beside the program (an installation), or in the source tree that built it.
[[nodiscard]] std::vector<OfferedScene> shipped_scenes();
// The latest first. Files that are gone are left out.
[[nodiscard]] std::vector<OfferedScene> recent_scenes();
// Puts a scene first in the list of recent ones. If the list cannot be written, it stays as it is.
void note_recent_scene(const std::filesystem::path& file);

// The first line of comments of a scene's text, without the sign; empty: none.
[[nodiscard]] std::string first_comment(const std::string& text);

}  // namespace hybrid
