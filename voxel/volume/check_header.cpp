// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/volume/check_header.h"

#include <fstream>

#include "voxel/volume/foreign_file.h"
#include "voxel/volume/text_header.h"

namespace voxel {

namespace fs = std::filesystem;

std::uint64_t size_of_file(const fs::path& path) {
  std::error_code error;
  const std::uintmax_t bytes = fs::file_size(path, error);
  return error ? 0 : bytes;
}

std::uint64_t bytes_in_file(const VoxelPlace& place, const VolumeHeader& header) {
  if (!place.stored) return header.bytes;
  std::uint64_t bytes = size_of(*place.stored);
  for (const int n : header.dims) bytes *= static_cast<std::uint64_t>(n);
  return bytes;
}

VolumeFormat format_of(const fs::path& path) {
  const std::string name = lower_case(path.filename().string());
  if (ends_with(name, ".nii") || ends_with(name, ".nii.gz")) return VolumeFormat::nifti;
  if (ends_with(name, ".nrrd") || ends_with(name, ".nhdr")) return VolumeFormat::nrrd;
  if (ends_with(name, ".mha") || ends_with(name, ".mhd")) return VolumeFormat::meta;
  if (ends_with(name, ".dcm") || ends_with(name, ".ima")) {
    refuse_volume(path, "this is one slice of a DICOM series; give the folder that holds the series");
  }
  refuse_volume(path, "the name's ending is not one of a volume; ", kVolumeFormats);
}

VoxelPlace inspect_volume(const fs::path& path, VolumeFormat format) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status)) refuse_volume(path, "there is no such file; correct the path");
  if (!fs::is_regular_file(status))
    refuse_volume(path, "this is neither a file nor a folder; ", kVolumeFormats);
  if (!std::ifstream(path)) refuse_volume(path, "the file cannot be opened; check its permissions");
  VoxelPlace place;
  place.file = path;
  place.file_bytes = size_of_file(path);
  if (place.file_bytes == 0) refuse_volume(path, "the file is empty; copy or export it again");
  refuse_foreign_file(path, format == VolumeFormat::nifti);
  switch (format) {
    case VolumeFormat::nifti:
      inspect_nifti(path, place);
      break;
    case VolumeFormat::nrrd:
      inspect_nrrd(path, place);
      break;
    case VolumeFormat::meta:
      inspect_meta(path, place);
      break;
  }
  if (place.file != path) refuse_foreign_file(place.file, true);
  if (!place.stated_unit.empty() && !place.unit_m) {
    place.notes.push_back("the header gives its lengths in '" + place.stated_unit +
                          "', which is no known unit of length; they are taken in mm");
  }
  return place;
}

void check_file_size(const fs::path& path, const VoxelPlace& place, VolumeHeader& header) {
  const std::uint64_t left = place.file_bytes > place.offset ? place.file_bytes - place.offset : 0;
  // As text, a voxel takes at least one digit and a blank. In memory it takes at most eight bytes.
  const bool raw = place.packing == VoxelPlace::Packing::raw;
  const double most = raw ? 1.0 : place.packing == VoxelPlace::Packing::text ? 8.0 : kMostPacked;
  const std::uint64_t needed = bytes_in_file(place, header);
  if (static_cast<double>(needed) <= most * static_cast<double>(left)) {
    if (raw && place.as_they_are && left > needed) {
      header.notes.push_back("the file goes on for " + std::to_string(left - needed) +
                             " bytes behind the last voxel; look whether the header's sizes are right");
    }
    return;
  }
  refuse_volume(path, "the header says ", header.dims[0], " x ", header.dims[1], " x ", header.dims[2],
                " voxels of ", header.component, ", ", needed, " bytes, but '", place.file.string(),
                "' has only ", left, raw ? " bytes of them; " : " packed bytes; ", kDamaged);
}

}  // namespace voxel
