// SPDX-License-Identifier: GPL-3.0-or-later
// Checks that every element of a DICOM file fits into the file, before GDCM opens it. Internal to the readers
// (read_volume.h). GDCM allocates the length that an element states, up to 4 GB each, before it notices the
// end of the file. Source: DICOM PS3.5, chapter 7.
#pragma once

#include <filesystem>

namespace voxel {

enum class DicomKind {
  none,
  without_image,
  image
};  // no DICOM; DICOM of another kind (a directory, a report)

// Walks the elements of a file without keeping them. Throws VolumeError if an element is longer than the rest
// of the file.
DicomKind check_dicom(const std::filesystem::path& path);

}  // namespace voxel
