// SPDX-License-Identifier: GPL-3.0-or-later
// Recognises files that stand in the place of a volume and are none. Internal to the readers (read_volume.h).
#pragma once

#include <filesystem>

namespace voxel {

// Throws VolumeError, with the cause and the remedy, if the first bytes of the file are those of a pointer
// that version control puts in the place of a file, of a web page, or of an archive. `may_be_gzip`:
// the format may be packed by gzip.
void refuse_foreign_file(const std::filesystem::path& path, bool may_be_gzip);

}  // namespace voxel
