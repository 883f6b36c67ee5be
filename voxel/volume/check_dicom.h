// SPDX-License-Identifier: GPL-3.0-or-later
// Checks that every element of a DICOM file fits into the file, before GDCM opens it. Internal to the readers
// (read_volume.h). GDCM allocates the length that an element states, up to 4 GB each, before it notices the
// end of the file. Source: DICOM PS3.5, chapter 7.
#pragma once

#include <cstddef>
#include <filesystem>

namespace voxel {

enum class DicomKind {
  none,
  without_image,  // such as a directory or a report
  image
};

// Properties of a file's pixels, as its elements state them.
struct DicomFile {
  DicomKind kind = DicomKind::none;
  std::size_t frames = 1;        // as the header says
  bool big_endian = false;       // the high byte of a number comes first
  bool pixels_as_bytes = false;  // the pixels are stated as bytes (OB), not as 16-bit words (OW)
};

// Walks the elements of a file without keeping them. Throws VolumeError if an element is longer than the rest
// of the file. A file without the DICOM preamble is recognised by its first element.
DicomFile check_dicom(const std::filesystem::path& path);

}  // namespace voxel
