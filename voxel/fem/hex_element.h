// SPDX-License-Identifier: GPL-3.0-or-later
// The accurate energy: elastic bricks between voxel centres.
//
// A voxel is a node. Where eight voxels around a cell are filled, the cell is a trilinear 8-node brick with
// incompatible modes (Wilson et al. 1973, made to pass the patch test as Taylor, Beresford & Wilson 1976),
// the nine of which are condensed out: the brick bends without locking in shear, and gives way in volume up
// to ν 0.499. On a regular lattice it is what CalculiX calls C3D8I. Rejected: plain bricks (+8 % at ν 0.45)
// and a volume term taken at the centre (−2 %), at equal cost.
//
// Material: a brick is of the softest of its eight voxels, so that a stiff region, like the object itself,
// ends at the centres of its outermost voxels. Rejected: means of the eight, which put an interface half a
// spacing outside and are 3 to 80 % off where a layer is two spacings thick.
#pragma once

#include <array>
#include <cstddef>
#include <glm/vec3.hpp>

namespace voxel {

// Stiffness of one brick (unit: N/m): force on (corner, axis) by displacement of (corner, axis), with rows
// and columns 3·corner + axis and corner = x + 2y + 4z, x, y, z 0 on the low side and 1 on the high side.
// Symmetric, positive semi-definite; its six zero modes are the small rigid motions.
struct BrickStiffness {
  std::array<double, 576> entry{};

  [[nodiscard]] double at(std::size_t row, std::size_t column) const { return entry[24 * row + column]; }
};

// Throws std::invalid_argument in words: modulus or spacing not positive and finite, ν outside 0 <= ν < 0.5.
[[nodiscard]] BrickStiffness brick_stiffness(double young_Pa, double poisson, const glm::dvec3& spacing_m);

// The quarters of links that a cell of eight voxels has in the six-link energy (voxel/lattice/link_stiffness.h), as such
// a stiffness. Throws as brick_stiffness().
[[nodiscard]] BrickStiffness link_cell_stiffness(double young_Pa, double poisson,
                                                 const glm::dvec3& spacing_m);
[[nodiscard]] BrickStiffness difference(const BrickStiffness& a, const BrickStiffness& b);
// The most that the energy of `brick` is of that of `links`, in any deformation: the largest λ of
// K_brick x = λ K_links x.
[[nodiscard]] double largest_ratio(const BrickStiffness& brick, const BrickStiffness& links);

// The bricks around a node, in the octants x + 2y + 4z (x, y, z 1 on the high side); null where there is
// none.
using BricksAround = std::array<const BrickStiffness*, 8>;

// How a node's force depends on its neighbourhood: force_on_node = −Σ block[o]·(u[o] − u[13]), with
// o = (x+1) + 3(y+1) + 9(z+1) for the neighbour at offset (x, y, z) and 13 the node itself (unit: N/m).
// Differences, because then a rigid shift, however large, is exactly no force in floats. Each block is 3×3,
// row by row; block[13], which the sum does not need, is the diagonal one: the node's own stiffness.
struct NodeStencil {
  alignas(16) std::array<std::array<float, 12>, 27> block{};
};

[[nodiscard]] NodeStencil node_stencil(const BricksAround& bricks);
// All eight the same: the stencil of the inside of a material.
[[nodiscard]] NodeStencil node_stencil(const BrickStiffness& brick);

}  // namespace voxel
