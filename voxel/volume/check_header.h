// SPDX-License-Identifier: GPL-3.0-or-later
// Checks the header of a single volume file, and reads the frame of NIfTI and NRRD. Internal to the readers
// (read_volume.h). The libraries behind ITK trust a header: they fill arrays of fixed size, expand printf
// patterns, open other files, allocate the stated sizes, and read missing voxels as zeros. Every entry that
// they trust is checked here first.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
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

// Largest ratio of unpacked to packed size. Deflate reaches 1,032; the rest is margin.
inline constexpr double kMostPacked = 1100.0;

// Selects the format by the ending of the name. Throws VolumeError.
VolumeFormat format_of(const std::filesystem::path& path);

// Location and encoding of the voxels of a file, and their frame.
struct VoxelPlace {
  enum class Packing { raw, text, deflate, other };
  std::filesystem::path file;    // the header's own file, or a file beside it
  std::uint64_t file_bytes = 0;  // size of `file`
  std::uint64_t offset = 0;      // bytes in `file` before the voxels (raw) or before the packed stream
  std::uint64_t skipped = 0;     // bytes of the unpacked stream before the voxels
  Packing packing = Packing::raw;
  bool swapped = false;                 // byte order differs from this machine's
  bool as_they_are = true;              // false: only the format's library finds the voxels
  double slope = 1.0, intercept = 0.0;  // intensity = slope · stored number + intercept
  // Component type of the voxels, as the NIfTI or NRRD header states it. A MetaImage header is read by its
  // library, which sets the type and the frame.
  std::optional<Component> stored;
  FileFrame frame;               // in the header's length unit
  std::optional<double> unit_m;  // length unit that the header states
  std::string stated_unit;       // as the header spells it; empty if it states none
  bool directions_known = true;  // the header says how the axes lie in the patient
  std::size_t axes = 3;          // number of axes that the header gives
  std::vector<std::string> notes;
};

// Throws VolumeError if the header does not describe a volume of the format.
VoxelPlace inspect_volume(const std::filesystem::path& path, VolumeFormat format);

// The headers of the three formats. Each fills `place`, whose file and size are set, and throws VolumeError
// if the header does not describe one volume of its format.
void inspect_nifti(const std::filesystem::path& path, VoxelPlace& place);
void inspect_nrrd(const std::filesystem::path& path, VoxelPlace& place);
void inspect_meta(const std::filesystem::path& path, VoxelPlace& place);

// Throws VolumeError if the header announces more voxels than the file can hold; call before allocating.
// Adds a note to the header if the file holds more bytes than announced.
void check_file_size(const std::filesystem::path& path, const VoxelPlace& place, VolumeHeader& header);

// Size of all voxels as encoded in the file, unpacked. (unit: byte)
std::uint64_t bytes_in_file(const VoxelPlace& place, const VolumeHeader& header);

// Size of a file (unit: byte); 0 if it cannot be read.
std::uint64_t size_of_file(const std::filesystem::path& path);

}  // namespace voxel
