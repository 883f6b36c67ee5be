// SPDX-License-Identifier: GPL-3.0-or-later
// Recognises files that stand in the place of a volume but are not volumes. Internal to the readers
// (read_volume.h).
#pragma once

#include <filesystem>

namespace voxel {

// Throws VolumeError, with the cause and the remedy, if the file is a web page, an archive, or a pointer that
// version control puts in the place of a file. Only the first bytes are read.
// `may_be_gzip`: the format may be packed by gzip.
void refuse_foreign_file(const std::filesystem::path& path, bool may_be_gzip);

}  // namespace voxel
