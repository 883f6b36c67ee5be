// SPDX-License-Identifier: GPL-3.0-or-later
// Writes labels and vectors slice by slice, compressed, as NIfTI, NRRD or MetaImage. A temporary file beside
// the path replaces the target at the end, so that a crash never leaves half a volume. ITK is not used: it
// cannot stream these formats compressed, holds every voxel two or three times, and its NIfTI writer does not
// report a full disk.
#pragma once

#include <filesystem>
#include <functional>
#include <glm/vec3.hpp>
#include <span>
#include <string>

#include "voxel/volume/label_volume.h"

namespace voxel {

// Lattice and frame of a volume; members as in LabelVolume.
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

// Callbacks that fill slice k, x fastest.
using LabelSlice = std::function<void(int k, std::span<std::uint8_t>)>;
using VectorSlice = std::function<void(int k, std::span<glm::vec3>)>;

// The ending of a volume's name, as spelled: ".nii", ".nii.gz", ".nrrd", ".nhdr", ".mha" or ".mhd". Throws
// VolumeError for any other ending.
std::string volume_ending(const std::filesystem::path& path);

// The ending of the name selects the format: .nii, .nii.gz, .nrrd, .nhdr, .mha, .mhd. `unit_m` is the file's
// length unit. At most one slice is in memory. Throws VolumeError.
void write_labels(const std::filesystem::path& path, const VolumeFrame& frame, const LabelSlice& slice,
                  double unit_m = 1e-3);

// NRRD and MetaImage keep the frame to double precision, NIfTI to single. Throws VolumeError.
void save_volume(const std::filesystem::path& path, const LabelVolume& volume, double unit_m = 1e-3);

// Writes a displacement field that ITK and 3D Slicer read (itk::Image<itk::Vector<float, 3>, 3>): components
// along the axes of the physical space (LPS), in the file's length unit. `slice` fills vectors in meters
// along the axes of the physical space. For NIfTI, which stores the three components apart, `slice` is called
// three times for every k. Throws VolumeError.
void write_vectors(const std::filesystem::path& path, const VolumeFrame& frame, const VectorSlice& slice,
                   double unit_m = 1e-3);

}  // namespace voxel
