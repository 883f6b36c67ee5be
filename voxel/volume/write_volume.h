// SPDX-License-Identifier: GPL-3.0-or-later
// Writes labels and vectors slice by slice, packed, as NIfTI, NRRD or MetaImage. Not by ITK: it streams none
// of these packed, holds every voxel two or three times, and its NIfTI tells nobody of a full disk. What is
// written goes to a temporary file beside the path, which replaces it at the end: a crash leaves no half of a
// volume.
#pragma once

#include <filesystem>
#include <functional>
#include <glm/vec3.hpp>
#include <span>
#include <string>

#include "voxel/volume/label_volume.h"

namespace voxel {

// Where the voxels lie; as in LabelVolume.
struct VolumeFrame {
  std::array<int, 3> dims{0, 0, 0};
  glm::dvec3 spacing_m{1e-3};
  glm::dvec3 origin_m{0.0};
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};

  [[nodiscard]] std::size_t slice_size() const {
    return static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1]);
  }
};
VolumeFrame frame_of(const LabelVolume& volume);

// Fill slice k, x fastest.
using LabelSlice = std::function<void(int k, std::span<std::uint8_t>)>;
using VectorSlice = std::function<void(int k, std::span<glm::vec3>)>;

// The ending of a volume's name: ".nii", ".nii.gz", ".nrrd", ".nhdr", ".mha" or ".mhd", as it is spelled.
// Throws VolumeError: any other.
std::string volume_ending(const std::filesystem::path& path);

// By the name's ending: .nii, .nii.gz, .nrrd, .nhdr, .mha, .mhd. Throws VolumeError in words. At most a slice
// is in memory.
void write_labels(const std::filesystem::path& path, const VolumeFrame& frame, const LabelSlice& slice,
                  double unit_m = 1e-3);

// NRRD and MetaImage keep the frame to double precision, NIfTI to single. Throws VolumeError.
void save_volume(const std::filesystem::path& path, const LabelVolume& volume, double unit_m = 1e-3);

// A displacement field as ITK and 3D Slicer read it (itk::Image<itk::Vector<float, 3>, 3>): components along
// the axes of the physical space (LPS), in the file's length unit. `slice` gives them in meters along the
// axes of the frame that origin_m and rotation lead to; NIfTI, which keeps the three components apart, asks
// for every slice three times.
void write_vectors(const std::filesystem::path& path, const VolumeFrame& frame, const VectorSlice& slice,
                   double unit_m = 1e-3);

}  // namespace voxel
