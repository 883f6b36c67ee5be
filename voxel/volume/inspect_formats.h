// SPDX-License-Identifier: GPL-3.0-or-later
// Reads the headers of the three formats, one function each. Internal to the readers (read_volume.h).
#pragma once

#include <filesystem>

#include "voxel/volume/check_header.h"

namespace voxel {

// Each fills `place`, whose file and size are set, and throws VolumeError if the header does not describe one
// volume of its format.
void inspect_nifti(const std::filesystem::path& path, VoxelPlace& place);
void inspect_nrrd(const std::filesystem::path& path, VoxelPlace& place);
void inspect_meta(const std::filesystem::path& path, VoxelPlace& place);

}  // namespace voxel
