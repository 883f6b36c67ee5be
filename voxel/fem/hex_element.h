// SPDX-License-Identifier: GPL-3.0-or-later
// The accurate energy: elastic bricks (hexahedral elements) between voxel centres.
//
// A voxel is a node. A cell whose eight voxels are filled is a trilinear 8-node brick with incompatible modes
// (Wilson et al. 1973, modified to pass the patch test: Taylor, Beresford & Wilson 1976). The nine mode dofs
// are condensed out. The brick bends without shear locking and has no volumetric locking up to ν 0.499. On a
// regular lattice it equals CalculiX's element C3D8I.
//
// Material: a brick has the softest material of its eight voxels. So a stiff region, like the object itself,
// ends at the centres of its outermost voxels. A mean over the eight would move an interface outwards by half
// a spacing.
#pragma once

#include <array>
#include <cstddef>
#include <glm/vec3.hpp>

namespace voxel {

// Stiffness of one brick (unit: N/m): force on (corner, axis) by displacement of (corner, axis). Rows and
// columns are 3·corner + axis, corner = x + 2y + 4z; x, y, z are 0 on the low side and 1 on the high side.
// Symmetric, positive semi-definite. The six zero modes are the small rigid motions.
struct BrickStiffness {
  std::array<double, 576> entry{};

  [[nodiscard]] double at(std::size_t row, std::size_t column) const { return entry[24 * row + column]; }
};

// Throws std::invalid_argument if the modulus or a spacing is not positive and finite, or ν is outside
// 0 <= ν < 0.5.
[[nodiscard]] BrickStiffness brick_stiffness(double young_Pa, double poisson, const glm::dvec3& spacing_m);

// Stiffness of the links of a cell of eight voxels in the six-link energy (voxel/lattice/link_stiffness.h): a
// quarter of each of its 12 links, since four cells share a link. Throws as brick_stiffness().
[[nodiscard]] BrickStiffness link_cell_stiffness(double young_Pa, double poisson,
                                                 const glm::dvec3& spacing_m);
[[nodiscard]] BrickStiffness difference(const BrickStiffness& a, const BrickStiffness& b);
// Largest ratio of the energy of `brick` to that of `links` over all deformations: the largest λ of
// K_brick x = λ K_links x.
[[nodiscard]] double largest_ratio(const BrickStiffness& brick, const BrickStiffness& links);

// The bricks around a node, by octant x + 2y + 4z (x, y, z are 1 on the high side); null for a missing brick.
using BricksAround = std::array<const BrickStiffness*, 8>;

// Force stencil of a node (unit: N/m): force_on_node = −Σ block[o]·(u[o] − u[13]), with
// o = (x+1) + 3(y+1) + 9(z+1) for the neighbour at offset (x, y, z); 13 is the node itself. Differences make
// the force of a rigid shift, however large, exactly zero in floats. Each block is 3×3 in columns of four
// floats: entry (r, c) is block[o][4c + r]. block[13] is the node's own stiffness; the sum does not need it.
struct NodeStencil {
  alignas(16) std::array<std::array<float, 12>, 27> block{};
};

[[nodiscard]] NodeStencil node_stencil(const BricksAround& bricks);
// All eight bricks equal: the stencil inside one material.
[[nodiscard]] NodeStencil node_stencil(const BrickStiffness& brick);

}  // namespace voxel
