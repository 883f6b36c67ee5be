// SPDX-License-Identifier: GPL-3.0-or-later
// Checks of a scene's text before a TOML parser sees it.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string_view>

#include "hybrid/scene/scene.h"

namespace hybrid {

inline constexpr std::size_t most_scene_bytes = 16U * 1024 * 1024;
inline constexpr std::size_t most_scene_values = 1'000'000;  // about 300 MB at worst during reading
inline constexpr std::size_t most_key_parts = 64;            // parts of a.b.c; bounds the depth of the tree

// Place of the byte at offset `at`; columns count characters.
SourcePlace place_in_text(std::string_view text, std::size_t at);

// Throws SceneError if the text is empty, too large, UTF-16, Latin-1 or otherwise not UTF-8. It also throws
// if the text contains a zero byte, too many values, a key of too many parts, or non-ASCII characters outside
// strings and comments. No key of a scene needs such characters. In toml++ 3.3 they cause undefined
// behaviour: its test for Unicode white space ends in __builtin_unreachable().
void prescan_scene_text(std::string_view text, const std::filesystem::path& file);

}  // namespace hybrid
