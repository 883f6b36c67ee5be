// SPDX-License-Identifier: GPL-3.0-or-later
// Label volumes with the intensities that their labels come from, for surfaces between voxels.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "voxel/volume/read_volume.h"

namespace voxel {

struct IntensityVolume {
  LabelVolume labels;
  // Intensity of each voxel of `labels`, in the file's own numbers. Empty if the intensities do not fit into
  // max_bytes.
  std::vector<float> intensities;
  bool whole_numbers = false;  // the file holds whole numbers only
};

// Like load_volume(), but also loads the intensities if they fit into options.max_bytes. Throws VolumeError.
IntensityVolume load_intensities(const std::filesystem::path& path, const VolumeFileOptions& options,
                                 std::vector<std::string>* notes = nullptr);

}  // namespace voxel
