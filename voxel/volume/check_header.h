// SPDX-License-Identifier: GPL-3.0-or-later
// What a single volume file says about itself, found out before ITK sees it. Internal to volume_file.
// The libraries behind ITK trust a header more than a damaged file deserves: arrays of fixed size, printf
// patterns, other files, sizes to allocate, and voxels that are not all there read as zeros. What they would
// trust is checked here.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "voxel/volume/raw_volume.h"

namespace voxel {

enum class VolumeFormat { nifti, nrrd, meta };

inline constexpr const char* kVolumeFormats =
    "give a NIfTI file (.nii, .nii.gz), NRRD (.nrrd, .nhdr), MetaImage (.mha, .mhd) or a folder with one "
    "DICOM "
    "series";
inline constexpr const char* kDamaged =
    "the file is damaged, incomplete or not what its name says: copy or export it again";

// By the name's ending. Throws VolumeError.
VolumeFormat format_of(const std::filesystem::path& path);

// Where the voxels of a file are, and how.
struct VoxelPlace {
  enum class Packing { raw, text, deflate, other };
  std::filesystem::path file;    // the header's own, or one beside it
  std::uint64_t file_bytes = 0;  // of `file`
  std::uint64_t offset = 0;   // (unit: byte) in `file` before the voxels (raw), or before the packed stream
  std::uint64_t skipped = 0;  // (unit: byte) before the voxels inside the packed stream
  Packing packing = Packing::raw;
  std::uint64_t voxel_bytes = 0;  // (unit: byte) of a voxel in the file, where scaling may change it; or 0
  bool swapped = false;           // not in this machine's byte order
  bool as_they_are = true;        // raw or deflate: nothing but the byte order stands between file and voxels
  std::vector<std::string> notes;
};

// Throws VolumeError where the header is not one of a volume of the format.
VoxelPlace inspect_volume(const std::filesystem::path& path, VolumeFormat format);

// Refuses a header that announces more voxels than the file can hold, before memory is asked for, and notes
// where it holds more.
void check_file_size(const std::filesystem::path& path, const VoxelPlace& place, VolumeHeader& header);

// (unit: byte) of all voxels in the file, as they are there.
std::uint64_t bytes_in_file(const VoxelPlace& place, const VolumeHeader& header);

}  // namespace voxel
