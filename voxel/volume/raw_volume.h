// SPDX-License-Identifier: GPL-3.0-or-later
// A volume in its file's component type, between reading and labelling. Internal to the readers
// (read_volume.h); independent of ITK and of file formats. The functions check frames, memory and options.
// They label and resample the voxels.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <glm/mat3x3.hpp>
#include <locale>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "voxel/volume/read_volume.h"

namespace voxel {

enum class Component : std::uint8_t {
  uint8,
  int8,
  uint16,
  int16,
  uint32,
  int32,
  uint64,
  int64,
  float32,
  float64
};

const char* name_of(Component component);
std::size_t size_of(Component component);  // (unit: byte)

struct VolumeData {
  VolumeHeader header;
  Component component = Component::uint8;
  bool reversed = false;  // the first axis in `header` is the reverse of the file's

  [[nodiscard]] std::size_t slice_bytes() const {
    return header.bytes / static_cast<std::size_t>(header.dims[2]);
  }
};

// Returns the next slice of voxels: components in the file's order, x fastest, valid until the next call.
// Slices avoid holding the whole volume in the file's type, which may take eight times the memory of the
// labels.
using NextSlice = std::function<std::span<const std::byte>()>;

// Throws VolumeError; its text is the file, then the parts, concatenated.
template <typename... Parts>
[[noreturn]] void refuse_volume(const std::filesystem::path& path, const Parts&... parts) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text.precision(9);
  text << path.string() << ": ";
  (text << ... << parts);
  throw VolumeError(text.str());
}

// Frame of the lattice as the file states it, in the file's length unit.
struct FileFrame {
  std::array<double, 3> dims{0.0, 0.0, 0.0};
  glm::dvec3 spacing{1.0}, origin{0.0};
  glm::dmat3 direction{1.0};  // columns are the axes of the lattice
};

// Completes a frame whose file gives only the first `given` axes (0 to 3). The missing axes have one voxel.
// They get directions at right angles to the given axes.
void complete_axes(FileFrame& frame, std::size_t given);

// Checks the frame and fills the header's dims, spacing, origin, rotation, component and bytes. Throws
// VolumeError. A left-handed frame gets its first axis reversed, with a note.
void set_frame(const std::filesystem::path& path, const FileFrame& frame, Component component, double unit_m,
               VolumeData& data);

// Throws VolumeError, with the numbers, if reading would need more than max_bytes. Counted are `copies`
// copies of the voxels, one slice and the labels.
void check_memory(const std::filesystem::path& path, const VolumeData& data, double copies,
                  const std::optional<glm::dvec3>& spacing_m, std::uint64_t max_bytes);

// Labels of the voxels, resampled if options.spacing_m is set. Calls `next` once for every slice.
// `intensities` (may be null) receives the intensities of the labelled voxels. It stays empty if they do not
// fit into options.max_bytes.
LabelVolume label_voxels(const std::filesystem::path& path, const VolumeData& data, const NextSlice& next,
                         const VolumeFileOptions& options, std::vector<float>* intensities = nullptr);

VolumeStatistics statistics_of(const VolumeData& data, const NextSlice& next);

// Computes slope · voxel + intercept for each voxel in double and stores it as type `to`. Whole-number types
// are clamped to their range. `out` has as many voxels as `voxels`.
void rescale_voxels(Component from, std::span<const std::byte> voxels, double slope, double intercept,
                    Component to, std::span<std::byte> out);

// Throws VolumeError for a rule or a spacing that is invalid for every file.
void check_options(const std::filesystem::path& path, const VolumeFileOptions& options);

}  // namespace voxel
