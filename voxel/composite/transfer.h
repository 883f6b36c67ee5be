// SPDX-License-Identifier: GPL-3.0-or-later
// Prolongation and restriction between two levels of a CompositeGrid, a row at a time.
//
// A node between two coarse nodes is interpolated along x, then y, then z. In tissue of one stiffness its
// weights are one half each. Where stiffness differs they are proportional to the links on either side, so
// that a node in a stiff skin on soft fat moves with the skin (operator interpolation: Alcouffe, Brandt,
// Dendy & Painter 1981, The multi-grid method for the diffusion equation with strongly discontinuous
// coefficients). Restriction uses the transposed weights.
#pragma once

#include <array>
#include <cstddef>

#include "voxel/lattice/simd8.h"
#include "voxel/lattice/simd_dispatch.h"

namespace voxel::composite {

// Prolongation of one fine row. `rows`: the coarse rows that contribute; each begins at the coarse lane of
// fine lane 0. `weights`: their weights.
struct ProlongArgs {
  std::array<const float*, 4> rows;
  std::array<float, 4> weights;
  int count = 0;
  bool odd = false;  // lane 0 is between two coarse lanes
  // lane_weight: for each fine lane, the weight of the coarse lane after it.
  const float *lane_weight, *lower, *negated_upper, *is_free;  // bounds null: none
  float* u;
  int vectors;
  bool adds;  // true: adds a correction to the free nodes; false: sets all nodes
};
void prolong_row(const ProlongArgs& args) noexcept;

// Operator interpolation of one fine row, which may lie between coarse rows in y, in z or in both.
struct ProlongByLinksArgs {
  std::array<const float*, 4> rows;  // coarse rows; [0]: before in y and z; +1: after in y; +2: after in z
  // [n] Weights of the links along x of the fine row at the place of rows[n].
  std::array<const float*, 4> link_x;
  // Weights of the links along y before and after the fine row. [0]: in the plane of rows[0]; [1]: in the
  // plane after it in z.
  std::array<std::array<const float*, 2>, 2> link_y;
  std::array<const float*, 2> link_z;  // weights of the links along z before and after the fine row
  bool between_y, between_z;
};
void prolong_row_by_links(const ProlongArgs& args, const ProlongByLinksArgs& by) noexcept;

// Transposed operator interpolation onto one coarse row, from the fine row at its place and up to eight rows
// around it. Index [z][y]: 0 before, 1 own, 2 after. share_y, share_z: a share of one half marks a row that
// lies between two coarse rows. The links of such a row decide which share of it this coarse row receives.
struct RestrictArgs {
  std::array<std::array<const float*, 3>, 3> rows;  // null: no such row
  std::array<float, 3> share_y, share_z;
  // Links before and after the row.
  std::array<std::array<std::array<const float*, 2>, 3>, 3> link_z;  // [z][y]
  std::array<std::array<const float*, 2>, 3> link_y;                 // [y], rows with the z of the coarse row
  const float* link_x;  // of the fine row at the coarse row's place
  int vectors;
  // Results by fine lane. `sum`: over the rows. `upper_share`: share of the sum for the next coarse node in
  // x, if the lane lies between two coarse nodes.
  float *sum, *upper_share;
};
void restrict_row_by_links(const RestrictArgs& args) noexcept;

}  // namespace voxel::composite
