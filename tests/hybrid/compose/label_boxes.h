// SPDX-License-Identifier: GPL-3.0-or-later
// Segmentations made of boxes, for the tests of `hybrid compose`.
#pragma once

#include <array>
#include <vector>

#include "voxel/volume/label_volume.h"

namespace tests {

// A box of voxels with a label. Later boxes overwrite earlier ones.
struct LabelBox {
  std::array<int, 3> low, high;  // inclusive
  std::uint8_t label;
};

inline voxel::LabelVolume volume_of(const std::vector<LabelBox>& boxes, double spacing_m = 2e-3) {
  voxel::LabelVolume volume;
  volume.dims = {44, 40, 32};
  volume.spacing_m = glm::dvec3(spacing_m);
  volume.origin_m = {-0.04, 0.01, 0.3};
  volume.labels.assign(44U * 40U * 32U, 0);
  for (const LabelBox& box : boxes) {
    for (int k = box.low[2]; k <= box.high[2]; ++k) {
      for (int j = box.low[1]; j <= box.high[1]; ++j) {
        for (int i = box.low[0]; i <= box.high[0]; ++i) volume.labels[volume.index(i, j, k)] = box.label;
      }
    }
  }
  return volume;
}

// A liver between a rib and a vertebra, a spleen that touches nothing, and a speck of spleen.
inline std::vector<LabelBox> torso() {
  return {{{8, 12, 8}, {31, 27, 23}, 1},
          {{8, 8, 8}, {13, 11, 23}, 2},
          {{14, 28, 8}, {25, 33, 23}, 3},
          {{35, 12, 8}, {42, 27, 23}, 4},
          {{2, 2, 2}, {2, 3, 2}, 4}};
}

}  // namespace tests
