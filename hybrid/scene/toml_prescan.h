// SPDX-License-Identifier: GPL-3.0-or-later
// What must hold of a scene's text before a TOML parser may see it.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string_view>

#include "hybrid/scene/scene.h"

namespace hybrid {

inline constexpr std::size_t most_scene_bytes = 16U * 1024 * 1024;
inline constexpr std::size_t most_scene_values = 1'000'000;  // about 300 MB at worst while it is read
inline constexpr std::size_t most_key_parts = 64;            // of a.b.c; bounds the depth of the tree

// Where the byte at `at` stands; columns count characters.
SourcePlace place_in_text(std::string_view text, std::size_t at);

// Throws SceneError: empty, too large, UTF-16, a zero byte, too many values, a key of too many parts, and
// characters outside ASCII where only keys and values stand: no key of a scene has them, and toml++ 3.3 runs
// into undefined behaviour on them (its test for Unicode white space ends in __builtin_unreachable()).
void screen_scene_text(std::string_view text, const std::filesystem::path& file);

}  // namespace hybrid
