// SPDX-License-Identifier: GPL-3.0-or-later
// Reads label volumes from files: NIfTI, NRRD, MetaImage, or a folder with one DICOM series. (write_volume.h
// writes them.) Only these readers use ITK.
// Frame: positions of every format are returned in the world frame of ITK and DICOM, in which x points to the
// patient's left, y to the back and z to the head (LPS). That frame is the scene's. NIfTI states positions in
// RAS (x right, y front). So x and y change sign on reading and again on saving, and viewers show the same
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

// A file that cannot be used. what() names the file, the error and the remedy.
class VolumeError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Header of a volume, read without the voxels.
struct VolumeHeader {
  std::string format;     // "NIfTI", "NRRD", "MetaImage", "DICOM series"
  std::string component;  // "uint8", "int16", "float32", ...
  std::array<int, 3> dims{0, 0, 0};
  glm::dvec3 spacing_m{0.0};
  glm::dvec3 origin_m{0.0};
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};
  std::uint64_t bytes = 0;  // size of the voxels in memory, in the file's component type
  // False if nothing in the file says how its axes lie in the patient (the notes say so, too). Then x, y and
  // z are the file's own, and no side of the volume can be called left, front or head.
  bool directions_known = true;
  std::vector<std::string> notes;  // e.g. axes flipped to make the frame right-handed
};

// A range of intensities (or one label) that becomes one label. The first rule that matches a voxel wins. A
// voxel that matches no rule is empty (0).
struct LabelRule {
  double lower = 0.0, upper = 0.0;  // inclusive, in the file's own intensity
  std::uint8_t label = 1;           // 1..255
};

struct VolumeFileOptions {
  // Length unit of the file's numbers, which counts even if the header states another. Without a value, it is
  // the unit that the header states, or the millimeter if it states none.
  std::optional<double> unit_m;
  std::vector<LabelRule> rules;  // empty: the file holds labels 0..255, kept as they are
  // Resample to this spacing (nearest neighbour). Without a value, the file's spacing is kept.
  std::optional<glm::dvec3> spacing_m;
  // Limit of the memory that loading takes: the voxels (with the copies that the libraries make) and the
  // labels. Above the limit VolumeError is thrown, with the numbers, before allocation.
  std::uint64_t max_bytes = 8ULL * 1024 * 1024 * 1024;
};

// `path` is a file, or a folder holding one DICOM series. Throws VolumeError.
VolumeHeader read_volume_header(const std::filesystem::path& path,
                                const std::optional<double>& unit_m = std::nullopt);

// Axes are never permuted. Only a left-handed frame is changed: its first axis is reversed, so that
// `rotation` is a proper rotation. `notes` receives the notes of the header (findings and corrections).
// Throws VolumeError.
LabelVolume load_volume(const std::filesystem::path& path, const VolumeFileOptions& options,
                        std::vector<std::string>* notes = nullptr);

// Labels with their voxel counts, and the range of intensities, for the command `check`.
struct VolumeStatistics {
  double minimum = 0.0, maximum = 0.0;
  std::size_t not_numbers = 0;  // voxels whose value is NaN: they are in no range
  // Empty unless every value is a whole number in 0..255. In rising order; 0 (empty) is listed if present.
  std::vector<std::pair<int, std::size_t>> label_counts;
};
// Throws VolumeError.
VolumeStatistics read_volume_statistics(const std::filesystem::path& path,
                                        std::uint64_t max_bytes = 8ULL << 30);

}  // namespace voxel
