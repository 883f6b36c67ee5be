// SPDX-License-Identifier: GPL-3.0-or-later
// A soft block with a core, in the form that a view gets.
#pragma once

#include <algorithm>
#include <memory>

#include "hybrid/snapshot/snapshot.h"
#include "voxel/lattice/lattice.h"

namespace tests {

// 20 voxels of 1 mm along each axis, about the origin. Gel (label 1) surrounds a core (label 2) of 10 voxels.
inline hybrid::DrawnInside cored_block() {
  voxel::LabelVolume volume{.dims = {20, 20, 20}, .spacing_m = glm::dvec3(1e-3), .labels = {}};
  for (int k = 0; k < 20; ++k) {
    for (int j = 0; j < 20; ++j) {
      for (int i = 0; i < 20; ++i) {
        const bool core = std::min({i, j, k}) >= 5 && std::max({i, j, k}) < 15;
        volume.labels.push_back(core ? 2 : 1);
      }
    }
  }
  voxel::LatticeOptions options;
  options.anchor_faces = {"-z"};
  hybrid::DrawnInside inside;
  inside.lattice = std::make_shared<voxel::Lattice>(volume, options);
  inside.origin_m = glm::dvec3(-9.5e-3);
  inside.materials = {"gel", "core"};
  inside.of_label[1] = 0;
  inside.of_label[2] = 1;
  return inside;
}

}  // namespace tests
