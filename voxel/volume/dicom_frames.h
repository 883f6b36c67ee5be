// SPDX-License-Identifier: GPL-3.0-or-later
// Frames of one DICOM file, read by GDCM. Internal to the readers (read_volume.h). Call in a child process
// only (subprocess.h): GDCM may abort. A classic file has one frame. An enhanced file has one frame per
// slice, and each has its own place, orientation, pixel spacing and rescaling.
#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "voxel/volume/check_dicom.h"
#include "voxel/volume/raw_volume.h"

namespace voxel {

// One frame. Lengths are in the file's unit (mm). Trivially copyable, because it crosses processes.
struct DicomFrame {
  FileFrame plane;  // one slice; spacing.z is its thickness, 0 if not stated
  Component stored = Component::int16;
  double lowest = 0.0, highest = 0.0;  // range of the stored numbers, from their number of bits
  double slope = 1.0, intercept = 0.0;
  bool has_spacing = false, has_position = false, has_orientation = false;
};

struct DicomHeader {
  std::string series;  // series instance UID
  std::vector<DicomFrame> frames;
};

// Throws VolumeError.
DicomHeader read_dicom_frames(const std::filesystem::path& path, const DicomFile& file);

// Stored numbers of all frames, in this machine's byte order. Throws VolumeError if their size is not
// `bytes`.
std::vector<std::byte> read_dicom_numbers(const std::filesystem::path& path, const DicomFile& file,
                                          Component stored, std::size_t bytes);

}  // namespace voxel
