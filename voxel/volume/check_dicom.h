// SPDX-License-Identifier: GPL-3.0-or-later
// Whether a DICOM file's lengths fit into it. Internal to volume_file: GDCM allocates whatever an element
// says it is long, up to 4 GB each, before it notices that the file ends.
#pragma once

#include <filesystem>

namespace voxel {

enum class DicomKind {
  none,
  without_image,
  image
};  // no DICOM; DICOM of another kind (a directory, a report)

// Walks the elements of a file without keeping them. Throws VolumeError where one is longer than what is
// left.
DicomKind check_dicom(const std::filesystem::path& path);

}  // namespace voxel
