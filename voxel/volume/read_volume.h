// SPDX-License-Identifier: GPL-3.0-or-later
// Volumes out of files. The only part of the project that knows ITK. (Into files: write_volume.h.)
// Frame: whatever the format, positions come out in ITK's (and DICOM's) world frame, in which x points to the
// patient's left, y to the back and z to the head (LPS). That frame is the scene's. NIfTI files state theirs
// as RAS (x right, y front), so their x and y change sign here and again on saving: viewers see the same
// place.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "voxel/volume/label_volume.h"

namespace voxel {

// A file that cannot be used: what() says what is wrong, where, and what to do next.
class VolumeError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// What a volume's header says, read without reading the voxels.
struct VolumeHeader {
  std::string format;     // "NIfTI", "NRRD", "MetaImage", "DICOM series"
  std::string component;  // "uint8", "int16", "float32", ...
  std::array<int, 3> dims{0, 0, 0};
  glm::dvec3 spacing_m{0.0};
  glm::dvec3 origin_m{0.0};
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};
  std::uint64_t bytes = 0;         // of the voxels once read, in memory
  std::vector<std::string> notes;  // e.g. slices missing, axes flipped to make the frame right-handed
};

// A range of intensities (or one label) that becomes one label. First match wins; no match is empty (0).
struct LabelRule {
  double lower = 0.0, upper = 0.0;  // inclusive, in the file's own intensity
  std::uint8_t label = 1;           // 1..255
};

struct VolumeFileOptions {
  double unit_m = 1e-3;          // length unit of the file (medical formats: mm)
  std::vector<LabelRule> rules;  // empty: the file holds labels 0..255, kept as they are
  // Resample to this spacing (nearest neighbour); as in the file otherwise.
  std::optional<glm::dvec3> spacing_m;
  // Most memory that loading may take: the voxels (with the copies that the libraries make) and
  // the labels. Refused above, with the numbers, before allocation.
  std::uint64_t max_bytes = 8ULL * 1024 * 1024 * 1024;
};

// `path` is a file, or a folder holding one DICOM series. Throws VolumeError.
VolumeHeader read_volume_header(const std::filesystem::path& path, double unit_m = 1e-3);

// The axes are permuted and flipped nowhere except where the file's frame is left-handed: then the first axis
// is reversed, so that `rotation` is a proper rotation. What was found and put right is said in `notes`, as
// in the header's. Throws VolumeError.
LabelVolume load_volume(const std::filesystem::path& path, const VolumeFileOptions& options,
                        std::vector<std::string>* notes = nullptr);

// The labels found and how many voxels each has, and the range of intensities, for `check`. Throws
// VolumeError.
struct VolumeStatistics {
  double minimum = 0.0, maximum = 0.0;
  // Only when every value is a whole number in 0..255; in rising order, with 0 (empty) where it occurs.
  std::vector<std::pair<int, std::size_t>> label_counts;
};
VolumeStatistics read_volume_statistics(const std::filesystem::path& path,
                                        std::uint64_t max_bytes = 8ULL << 30);

}  // namespace voxel
