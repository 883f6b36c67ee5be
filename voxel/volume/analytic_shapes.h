// SPDX-License-Identifier: GPL-3.0-or-later
// Label volumes from analytic shapes: a block or a ball, with layers and inclusions.
// A voxel is filled when its centre lies in the shape. Shapes are centred on the middle of the volume, which
// is the origin of the scene.
#pragma once

#include <variant>
#include <vector>

#include "voxel/volume/label_volume.h"

namespace voxel {

// Positions count from the middle of the volume.
struct Inclusion {
  enum class Shape : std::uint8_t { box, ball } shape = Shape::ball;
  glm::dvec3 centre_m{0.0};  // from the middle of the volume
  glm::dvec3 size_m{0.0};    // full size of the box; size.x is the ball's diameter
  std::uint8_t label = 2;
};

struct Layer {
  double thickness_m = 0.0;  // from the bottom (−z) up
  std::uint8_t label = 1;
};

struct Formula {
  enum class Shape : std::uint8_t { block, ball } shape = Shape::block;
  glm::dvec3 size_m{0.0};  // block: full size; ball: size.x is the diameter
  glm::dvec3 spacing_m{1e-3};
  std::uint8_t label = 1;
  std::vector<Layer> layers;          // block only; above the last layer the block has `label`
  std::vector<Inclusion> inclusions;  // a later inclusion overwrites an earlier one
};

// A voxel is filled when its centre lies in the shape; a block of size s at spacing h has round(s/h) voxels
// along an axis. The middle of the volume lies at the origin of the scene. Throws std::invalid_argument, with
// the numbers, if a size or a spacing is not finite and positive, or if the lattice would have more than
// `max_voxels`.
LabelVolume make_volume(const Formula& formula, std::size_t max_voxels);

}  // namespace voxel
