// SPDX-License-Identifier: GPL-3.0-or-later
// Checks the header of a single volume file before ITK opens it. Internal to the readers (read_volume.h).
// The libraries behind ITK trust a header: they fill arrays of fixed size, expand printf patterns, open other
// files, allocate the stated sizes, and read missing voxels as zeros. Every entry that they trust is checked
// here first.
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

// The format by the ending of the name. Throws VolumeError.
VolumeFormat format_of(const std::filesystem::path& path);

// Location and encoding of the voxels of a file.
struct VoxelPlace {
  enum class Packing { raw, text, deflate, other };
  std::filesystem::path file;    // the header's own file, or a file beside it
  std::uint64_t file_bytes = 0;  // of `file`
  std::uint64_t offset = 0;   // (unit: byte) in `file` before the voxels (raw), or before the packed stream
  std::uint64_t skipped = 0;  // (unit: byte) before the voxels inside the packed stream
  Packing packing = Packing::raw;
  std::uint64_t voxel_bytes = 0;  // (unit: byte) of a voxel in the file, before scaling; 0 if not known
  bool swapped = false;           // byte order differs from this machine's
  bool as_they_are = true;        // raw or deflate: the voxels need no conversion but byte order
  std::vector<std::string> notes;
};

// Throws VolumeError if the header does not describe a volume of the format.
VoxelPlace inspect_volume(const std::filesystem::path& path, VolumeFormat format);

// Throws VolumeError if the header announces more voxels than the file can hold; call before allocating.
// Adds a note to the header if the file holds more bytes than announced.
void check_file_size(const std::filesystem::path& path, const VoxelPlace& place, VolumeHeader& header);

// Size of all voxels as encoded in the file, unpacked. (unit: byte)
std::uint64_t bytes_in_file(const VoxelPlace& place, const VolumeHeader& header);

}  // namespace voxel
