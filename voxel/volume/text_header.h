// SPDX-License-Identifier: GPL-3.0-or-later
// Text headers of NRRD and MetaImage files. Internal to the readers (read_volume.h).
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

#include "voxel/volume/check_header.h"

namespace voxel {

inline constexpr const char* kNoSpacing = "the header gives no voxel spacing; one unit was put in its place";

bool ends_with(const std::string& text, const std::string& end);
bool starts_with(const std::string& text, const std::string& start);
std::string lower_case(std::string text);

// The "key = value" or "key: value" lines of a header. Keys are in lower case without blanks.
struct TextHeader {
  std::map<std::string, std::string> fields;
  std::uint64_t bytes = 0;  // length of the header in its file

  [[nodiscard]] bool has(const std::string& key) const { return fields.count(key) != 0; }
  [[nodiscard]] std::string text(const std::string& key) const;
  // `otherwise` if the field is absent; NaN if it is not a number.
  [[nodiscard]] double number(const std::string& key, double otherwise) const;
};

// Reads to the end of the header: an empty line (NRRD) or the line of `last_key` (MetaImage). Throws
// VolumeError.
TextHeader read_text_header(const std::filesystem::path& path, char separator, const std::string& last_key);

// Finds the file of the voxels that the header names. Throws VolumeError.
void find_data_file(const std::filesystem::path& header, const std::string& name, VoxelPlace& place);

// A byte count in a header. Returns 0 if the field is absent or is -1, which means that the voxels are at the
// end of the file. Throws VolumeError.
std::uint64_t bytes_to_skip(const std::filesystem::path& path, const TextHeader& header,
                            const std::string& key);

// Throws VolumeError unless `axes` is a number of axes that a header may give.
void check_axes(const std::filesystem::path& path, double axes);

}  // namespace voxel
