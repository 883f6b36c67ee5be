// SPDX-License-Identifier: GPL-3.0-or-later
// Reads the bytes of a file, unpacks gzip, and never holds more than a given limit.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace polygon {

// `packed`: the file must be gzip. Throws MeshError if the file is missing, not a regular file, unreadable,
// damaged, or larger than max_bytes. The limit holds for the size on disk and for the unpacked size, and is
// checked before more memory is taken.
std::string read_file_bytes(const std::filesystem::path& file, bool packed, std::uint64_t max_bytes);

}  // namespace polygon
