// SPDX-License-Identifier: GPL-3.0-or-later
// Forces of the accurate energy on nodes of a lattice of floats.
// Stencils and bricks come from voxel/fem/hex_element.h. Every force is a sum over differences to the node,
// so that a rigid shift gives exactly zero.
#pragma once

#include <array>
#include <cstddef>

#include "voxel/fem/hex_element.h"

namespace voxel {

// Displacements on a lattice, x fastest, one array per component (unit: m). The strides are the distances to
// the neighbours along y and z (unit: float). All 26 neighbours of an evaluated node must be readable: the
// lattice needs a border of one node.
struct NodeField {
  std::array<const float*, 3> u{};
  std::ptrdiff_t stride_y = 0, stride_z = 0;
};

// Force on `count` nodes in a row from `first`, within one material, written to force[axis][0 … count) (N).
// `inside` must be node_stencil(brick); the result is wrong for any other stencil. The kernel relies on equal
// blocks of opposite neighbours and on the zero entries of a rectangular brick.
void row_forces(const NodeStencil& inside, const NodeField& field, std::size_t first, std::size_t count,
                const std::array<float*, 3>& force);

// Force on one node with any stencil (N), for nodes where materials meet or bricks are missing.
[[nodiscard]] std::array<float, 3> node_force(const NodeStencil& stencil, const NodeField& field,
                                              std::size_t node);

// A brick in floats, for nodes with mixed materials: their neighbourhoods are too many for a stencil each.
using BrickFloats = std::array<float, 580>;  // 24 × 24, padded for the last vector load
[[nodiscard]] BrickFloats in_floats(const BrickStiffness& brick);

// Force on one node (N) from the bricks around it, by the octants of BricksAround; null for a missing brick.
[[nodiscard]] std::array<float, 3> node_force(const std::array<const BrickFloats*, 8>& bricks,
                                              const NodeField& field, std::size_t node);

}  // namespace voxel
