// SPDX-License-Identifier: GPL-3.0-or-later
// One DICOM series in a folder. Internal to the readers (read_volume.h).
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "voxel/volume/dicom_frames.h"
#include "voxel/volume/subprocess.h"

namespace voxel {

struct DicomSlice {
  std::filesystem::path path;
  DicomFile file;
  std::size_t index = 0;  // of the frame in its file
  DicomFrame frame;
  double height = 0.0;  // position along the slice normal (unit: the file's)
};

struct DicomSeries {
  std::vector<DicomSlice> slices;  // ordered along the slice normal
  VolumeData data;                 // without voxels
};

// Throws VolumeError. `unit_m`: see VolumeFileOptions.
DicomSeries read_dicom_header(const std::filesystem::path& folder, const std::optional<double>& unit_m);

// All voxels of the series, slice after slice. Throws VolumeError.
std::unique_ptr<SharedMemory> read_dicom_voxels(const std::filesystem::path& folder,
                                                const DicomSeries& series);

}  // namespace voxel
