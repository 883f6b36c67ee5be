// SPDX-License-Identifier: GPL-3.0-or-later
// Forces of the accurate energy on nodes of a lattice of floats: what a relaxation calls.
#pragma once

#include <array>
#include <cstddef>

#include "voxel/fem/hex_element.h"

namespace voxel {

// Displacements on a lattice, x fastest, one array a component (unit: m); neighbours along y and z are so
// many floats away. Every neighbour of a node that is asked for can be read: a lattice has a border of one.
struct NodeField {
  std::array<const float*, 3> u{};
  std::ptrdiff_t stride_y = 0, stride_z = 0;
};

// Force on `count` nodes in a row from `first`, within one material: `inside` is node_stencil(brick), of
// which this uses that opposite neighbours have equal blocks, and the zeros of a brick with right angles.
// Written to force[axis][0 … count) (N). Of any other stencil it is wrong.
void row_forces(const NodeStencil& inside, const NodeField& field, std::size_t first, std::size_t count,
                const std::array<float*, 3>& force);

// Force on one node of any stencil, where materials meet or bricks are missing (N).
[[nodiscard]] std::array<float, 3> node_force(const NodeStencil& stencil, const NodeField& field,
                                              std::size_t node);

// A brick in floats, for nodes whose neighbourhoods are too many to keep a stencil of each.
using BrickFloats = std::array<float, 580>;  // 24 × 24, and what a vector may read beyond
[[nodiscard]] BrickFloats in_floats(const BrickStiffness& brick);

// The same force from the bricks around the node, in the octants of BricksAround; null where there is none
// (N).
[[nodiscard]] std::array<float, 3> node_force(const std::array<const BrickFloats*, 8>& bricks,
                                              const NodeField& field, std::size_t node);

}  // namespace voxel
