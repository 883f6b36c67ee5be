// SPDX-License-Identifier: GPL-3.0-or-later
// The bytes of a file, unpacked when it is gzip, never more than asked for.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace polygon {

// `packed`: the file must be gzip. Throws MeshError: missing, not a regular file, unreadable, damaged, or
// larger than max_bytes (of what is on the disk, and of what it unpacks to; no more than that is ever held).
std::string read_file_bytes(const std::filesystem::path& file, bool packed, std::uint64_t max_bytes);

}  // namespace polygon
