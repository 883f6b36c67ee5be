// SPDX-License-Identifier: GPL-3.0-or-later
// Trilinear interpolation of displacements at a rest point.
#include "voxel/lattice/displacement.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace voxel {

glm::dvec3 displacement_at(const Lattice& lattice, const Displacement& state,
                           const glm::dvec3& rest_point) noexcept {
  const auto& dims = lattice.grid().dims;
  const glm::dvec3 cell = rest_point / lattice.spacing_m();
  std::array<int, 3> base{};
  std::array<double, 3> part{};
  for (std::size_t d = 0; d < 3; ++d) {
    const double c = std::clamp(cell[static_cast<int>(d)], -1.0, static_cast<double>(dims[d]) - 0.5);
    base[d] = static_cast<int>(std::floor(c));
    part[d] = c - base[d];
  }
  glm::dvec3 sum(0.0);
  double weight = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const int i = corner & 1, j = (corner >> 1) & 1, k = (corner >> 2) & 1;
    const VoxelId v = lattice.at(base[0] + i, base[1] + j, base[2] + k);
    if (!lattice.filled(v)) continue;
    const double w = (i != 0 ? part[0] : 1.0 - part[0]) * (j != 0 ? part[1] : 1.0 - part[1]) *
                         (k != 0 ? part[2] : 1.0 - part[2]) +
                     1e-9;  // a corner of weight 0 counts if it is the only voxel
    sum += w * state.at(v);
    weight += w;
  }
  return weight > 0.0 ? sum / weight : glm::dvec3(0.0);
}

}  // namespace voxel
