// SPDX-License-Identifier: GPL-3.0-or-later
// Argument checks that the functions of surface_nets.h share.
#pragma once

#include <cmath>

#include "voxel/volume/invalid_argument.h"
#include "voxel/volume/label_volume.h"

namespace hybrid {

using voxel::refuse;

inline void check_volume(const voxel::LabelVolume& volume) {
  const auto& n = volume.dims;
  const bool negative = n[0] < 0 || n[1] < 0 || n[2] < 0;
  const double expected = static_cast<double>(n[0]) * n[1] * n[2];
  if (negative || static_cast<double>(volume.labels.size()) != expected) {
    refuse("a volume of ", n[0], " x ", n[1], " x ", n[2], " voxels holds ", volume.labels.size(),
           " labels; build it with as many labels as voxels");
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (!(std::isfinite(volume.spacing_m[axis]) && volume.spacing_m[axis] > 0.0)) {
      refuse("a volume's spacing is ", volume.spacing_m[axis], " m along axis ", axis,
             "; it must be above 0");
    }
  }
}

}  // namespace hybrid
