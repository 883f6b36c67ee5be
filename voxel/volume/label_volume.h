// SPDX-License-Identifier: GPL-3.0-or-later
// A label volume: the material label of each voxel of a soft object, on a regular lattice.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/gtc/quaternion.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

namespace voxel {

// Labels on a lattice of dims[0] × dims[1] × dims[2] voxels, x fastest. 0 is empty.
// The centre of voxel (i, j, k) in the volume frame is (i, j, k)·spacing_m. Rotation and origin place the
// volume frame in the scene: point_in_scene = origin_m + rotation · point_in_volume.
struct LabelVolume {
  std::array<int, 3> dims{0, 0, 0};
  glm::dvec3 spacing_m{1e-3};               // each > 0, may differ per axis (CT slices)
  glm::dvec3 origin_m{0.0};                 // centre of voxel (0,0,0)
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};  // volume frame to scene, right-handed
  std::vector<std::uint8_t> labels;         // dims[0]*dims[1]*dims[2]

  [[nodiscard]] std::size_t voxel_count() const { return labels.size(); }
  [[nodiscard]] std::size_t index(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(dims[1]) + static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(dims[0]) +
           static_cast<std::size_t>(i);
  }
};

}  // namespace voxel
