// SPDX-License-Identifier: GPL-3.0-or-later
// Lattices that several tests of the voxel core are built on, and random ones that are the same everywhere.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <random>
#include <vector>

#include "voxel/lattice.h"

namespace tests {

// std::mt19937 is the same everywhere, the standard distributions are not.
class Random {
 public:
  explicit Random(std::uint32_t seed) : engine_(seed) {}
  double unit() { return static_cast<double>(engine_()) / 4294967296.0; }
  double between(double low, double high) { return low + (high - low) * unit(); }
  int below(int n) { return static_cast<int>(unit() * n); }

 private:
  std::mt19937 engine_;
};

inline voxel::LabelVolume block(const std::array<int, 3>& dims, const glm::dvec3& spacing,
                                std::uint8_t label = 1) {
  voxel::LabelVolume volume;
  volume.dims = dims;
  volume.spacing_m = spacing;
  volume.labels.assign(static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1]) *
                           static_cast<std::size_t>(dims[2]),
                       label);
  return volume;
}

// Limits so wide that none is ever active.
inline voxel::LinkMaterial elastic(double young_Pa, double poisson) {
  return {.young_Pa = young_Pa, .poisson = poisson, .stretch_min = 0.05, .stretch_max = 10.0, .shear = 10.0};
}

inline voxel::LatticeOptions made_of(const voxel::LinkMaterial& material, const char* face = "-z") {
  voxel::LatticeOptions options;
  options.materials.fill(material);
  if (face != nullptr) options.anchor_faces = {face};
  return options;
}

// Voxel (i, j, k) of the volume.
inline voxel::VoxelId voxel_at(const voxel::Lattice& lattice, int i, int j, int k) {
  return lattice.at(i, j, k);
}

// A scene as hard as a volume can be: up to 10×9×8 voxels of one to four materials, with holes and slits, and
// a few anchored voxels. Each material has limits and a stiffness of its own.
struct RandomScene {
  voxel::LabelVolume volume;
  voxel::LatticeOptions options;
  std::vector<std::size_t> filled;  // indices of the volume
};

inline RandomScene random_scene(Random& random, int anchors = 3) {
  RandomScene scene;
  scene.volume =
      block({2 + random.below(9), 1 + random.below(9), 1 + random.below(8)},
            {random.between(0.5e-3, 2e-3), random.between(0.5e-3, 2e-3), random.between(0.5e-3, 2e-3)});
  auto& volume = scene.volume;
  const int materials = 1 + random.below(4);
  const double holes = random.below(2) * random.between(0.0, 0.25);
  for (auto& label : volume.labels) {
    label = static_cast<std::uint8_t>(random.unit() < holes ? 0 : 1 + random.below(materials));
  }
  // A slit: part of a plane without voxels, which paths have to go round.
  if (random.below(2) != 0 && volume.dims[0] > 2) {
    const int i = 1 + random.below(volume.dims[0] - 2), until = random.below(volume.dims[1] + 1);
    for (int k = 0; k < volume.dims[2]; ++k) {
      for (int j = 0; j < until; ++j) volume.labels[volume.index(i, j, k)] = 0;
    }
  }
  volume.labels[0] = 1;
  for (std::size_t v = 0; v < volume.labels.size(); ++v) {
    if (volume.labels[v] != 0) scene.filled.push_back(v);
  }
  for (std::size_t label = 1; label <= 4; ++label) {
    scene.options.materials[label] = {.young_Pa = random.between(1e3, 1e5),
                                      .poisson = random.between(0.0, 0.45),
                                      .stretch_min = random.between(0.3, 1.0),
                                      .stretch_max = random.between(1.0, 2.0),
                                      .shear = random.between(0.0, 0.8)};
  }
  for (int n = 0; n < anchors; ++n) {
    scene.options.anchor_voxels.push_back(
        scene.filled[static_cast<std::size_t>(random.below(static_cast<int>(scene.filled.size())))]);
  }
  return scene;
}

// The voxel of the lattice that stands for an index of the volume.
inline voxel::VoxelId voxel_of(const voxel::Lattice& lattice, const voxel::LabelVolume& volume,
                               std::size_t index) {
  const auto nx = static_cast<std::size_t>(volume.dims[0]), ny = static_cast<std::size_t>(volume.dims[1]);
  return voxel_at(lattice, static_cast<int>(index % nx), static_cast<int>(index / nx % ny),
                  static_cast<int>(index / (nx * ny)));
}

}  // namespace tests
