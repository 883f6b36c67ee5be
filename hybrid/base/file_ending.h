// SPDX-License-Identifier: GPL-3.0-or-later
// The format that the ending of a file's name stands for.
#pragma once

#include <filesystem>
#include <initializer_list>
#include <string>
#include <string_view>

namespace hybrid {

// The ending in lower case, with its dot: ".toml" for "A.TOML". Empty if there is none.
std::string lower_ending(const std::filesystem::path& file);

// Is it the name of a mesh: .obj, .ply, .stl or .off, each also with .gz?
bool is_mesh_name(const std::filesystem::path& file);

// Is it the name of a volume: NIfTI (also with .gz), NRRD, MetaImage or one slice of DICOM?
bool is_volume_name(const std::filesystem::path& file);

// Refuses an output file whose ending stands for another format than `endings`: throws std::runtime_error
// with `option`, `file` and the allowed endings. Some names have any format: a name without an ending, "-",
// and anything that is no ordinary file (a pipe, /dev/stdout).
void require_ending(std::string_view option, const std::filesystem::path& file,
                    std::initializer_list<std::string_view> endings);

// For a file of the program's own format: refuses endings that stand for other formats.
void require_ending_of_none(std::string_view option, const std::filesystem::path& file);

}  // namespace hybrid
