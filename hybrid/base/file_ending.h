// SPDX-License-Identifier: GPL-3.0-or-later
// What the ending of a file's name says about its format.
#pragma once

#include <filesystem>
#include <initializer_list>
#include <string>
#include <string_view>

namespace hybrid {

// The ending in lower case, with its dot: ".toml" of "A.TOML"; empty where there is none.
std::string lower_ending(const std::filesystem::path& file);

// Whether the name is that of a mesh: .obj, .ply, .stl or .off, each also with .gz.
bool is_mesh_name(const std::filesystem::path& file);

// Refuses an output whose ending names another format than those that are written: throws std::runtime_error
// with `option`, `file` and the endings that work. A name without an ending, "-" and what is no ordinary file
// (a pipe, /dev/stdout) have any format.
void require_ending(std::string_view option, const std::filesystem::path& file,
                    std::initializer_list<std::string_view> endings);

// The same for a file of a format that no other program knows: refuses endings of formats that others know.
void require_ending_of_none(std::string_view option, const std::filesystem::path& file);

}  // namespace hybrid
