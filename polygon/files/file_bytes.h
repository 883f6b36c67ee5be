// SPDX-License-Identifier: GPL-3.0-or-later
// Reads the bytes of a file, unpacks gzip, and never holds more than a given limit.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace polygon {

// The reason why a file that begins with these bytes is no data file, and the remedy, in words for a message.
// 64 bytes are enough. Empty for a data file. Git LFS leaves pointers in place of files that were not
// fetched. Servers may send a web page instead of a file. A file of another format may have been renamed.
// gzip counts as a data file.
std::string_view other_kind(std::string_view first_bytes);

// `packed`: the file must be gzip. Throws MeshError if the file is missing, not a regular file, unreadable,
// damaged, or larger than max_bytes. The limit holds for the size on disk and for the unpacked size, and is
// checked before more memory is taken. The message for a file that is not data names its real kind
// (other_kind()).
std::string read_file_bytes(const std::filesystem::path& file, bool packed, std::uint64_t max_bytes);

}  // namespace polygon
