// SPDX-License-Identifier: GPL-3.0-or-later
// Forces of bricks (hex_element.h) on the nodes of a level, cell by cell, in vectors of 8 cells along x.
//
// A rectangular brick is symmetric under mirroring along each axis. In terms of the parities of its corner
// displacements, its stiffness matrix therefore falls into eight blocks of 3 × 3. With the transform of the
// corners (a Walsh–Hadamard transform) a brick costs 72 products in place of 576.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "voxel/fem/hex_element.h"

namespace voxel::composite {

// Blocks of minus a brick's stiffness (N/m). block[q][a][b] couples component a of parity q ^ 2^a with
// component b of parity q ^ 2^b. A parity p = x + 2y + 4z has x, y, z = 1 for an odd function along that
// axis.
struct BrickBlocks {
  std::array<std::array<std::array<float, 3>, 3>, 8> block{};
};
// Only for a matrix that is symmetric under the three mirrorings.
[[nodiscard]] BrickBlocks brick_blocks(const BrickStiffness& brick);

// A mean strain of a brick: the sum over a of weight[a] times component a of parity q ^ 2^a, with the
// strain's q. Its force on component a is −stiffness · weight[a] · strain.
struct MeanStrain {
  std::array<float, 3> weight{};
  float stiffness = 0.0F;
  float follows = 1.0F;  // share of a change of the strain that a cycle takes
};
// A brick less its links, as parts for an iteration that solves for the links (deferred correction). The
// dilation and the three shears are much stiffer in bricks than in links: 1 / (1 − 2ν) times, and up to 4
// times. So their strains are taken over cycles, each by its own share. All else is at most 1.4 times as
// stiff, and is taken at once.
struct DeferredBrick {
  static constexpr std::size_t kStrains = 4;  // dilation; shears of the planes xy, xz, yz
  static constexpr std::array<std::size_t, kStrains> kQ{0, 3, 5, 6};
  std::array<MeanStrain, kStrains> strain;
  BrickBlocks rest;
};
[[nodiscard]] DeferredBrick deferred_brick(const BrickStiffness& brick, const BrickStiffness& links);

// One level, from its first row on.
struct BrickView {
  std::array<const float*, 3> u;  // [axis] displacements (m)
  const float* modulus;           // of the cell above each node on all axes, relative to the brick's
  float scale;                    // of stiffness: edge of a cell, relative to the brick's
  std::array<float*, 3> force;    // [axis] receives the forces (N) in addition to its values
  std::array<int, 3> cells;       // along each axis
  // Cells without forces, because a finer patch covers them: from the first to the last along each axis. None
  // if the last is before the first.
  std::array<int, 3> covered_first, covered_last;
  std::size_t stride, plane;  // to the next node along y, along z
};
inline constexpr float kNewStrain = 1e30F;  // strain of a cell that takes the present strain at once
// Adds the forces of bricks at the displacements u.
void add_brick_forces(const BrickView& view, const BrickBlocks& blocks) noexcept;
// Adds the forces of bricks minus those of their links. `strains`, [strain] by cell, are the strains that the
// forces belong to. They follow the strains of the displacements u.
void add_deferred_forces(const BrickView& view, const DeferredBrick& brick,
                         const std::array<float*, DeferredBrick::kStrains>& strains) noexcept;

// The brick of a cell between voxels of the reference material. The links of the cell carry a part of its
// stiffness, which is subtracted here.
struct Bricks {
  DeferredBrick deferred;                            // in parts
  BrickBlocks less_links;                            // as a whole
  mutable std::array<std::vector<float>, 3> forces;  // [axis] scratch
};

}  // namespace voxel::composite
