// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/tissue/material_surface.h"

#include <algorithm>
#include <array>

#include "hybrid/geometry/surface_nets.h"
#include "voxel/lattice/lattice.h"

namespace hybrid {
namespace {

constexpr int kSmoothing = 6;  // smoothing passes, as many as for the surface of a whole soft object

// Calls `act` with the coordinates of every voxel of a material.
template <class Act>
void for_voxels(const DrawnInside& inside, std::size_t material, const Act& act) {
  const voxel::Lattice& lattice = *inside.lattice;
  const std::array<int, 3>& dims = lattice.grid().dims;
  for (int k = 0; k < dims[2]; ++k) {
    for (int j = 0; j < dims[1]; ++j) {
      for (int i = 0; i < dims[0]; ++i) {
        const voxel::VoxelId v = lattice.at(i, j, k);
        if (lattice.filled(v) && inside.of_label[lattice.label(v)] == material) act(std::array{i, j, k});
      }
    }
  }
}

}  // namespace

polygon::TriangleMesh surface_of_material(const DrawnInside& inside, std::size_t material) {
  if (inside.lattice == nullptr) return {};
  std::array<int, 3> low = inside.lattice->grid().dims, high{-1, -1, -1};
  for_voxels(inside, material, [&](const std::array<int, 3>& at) {
    for (std::size_t d = 0; d < 3; ++d) {
      low[d] = std::min(low[d], at[d]);
      high[d] = std::max(high[d], at[d]);
    }
  });
  if (high[0] < 0) return {};
  voxel::LabelVolume volume{.spacing_m = inside.lattice->spacing_m(), .labels = {}};
  for (std::size_t d = 0; d < 3; ++d) volume.dims[d] = high[d] - low[d] + 1;
  volume.labels.resize(static_cast<std::size_t>(volume.dims[0]) * static_cast<std::size_t>(volume.dims[1]) *
                       static_cast<std::size_t>(volume.dims[2]));
  for_voxels(inside, material, [&](const std::array<int, 3>& at) {
    volume.labels[volume.index(at[0] - low[0], at[1] - low[1], at[2] - low[2])] = 1;
  });
  polygon::TriangleMesh mesh = surface_from_labels(volume, kSmoothing);
  const glm::dvec3 first(low[0], low[1], low[2]);
  for (glm::dvec3& v : mesh.vertices) v = inside.from_voxels(first + v / volume.spacing_m);
  return mesh;
}

}  // namespace hybrid
