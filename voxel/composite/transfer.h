// SPDX-License-Identifier: GPL-3.0-or-later
// Between the levels of a composite grid, a row at a time: what a level is told by the next coarser one, and
// what that is told of it. A node that stands between two coarse ones goes by the mean of the two; or, where
// tissues differ, by its links: in a stiff skin on soft fat it goes with the skin (Alcouffe, Brandt, Dendy &
// Painter 1981, The multi-grid method for the diffusion equation with strongly discontinuous coefficients;
// here one axis after the other, x first).
#pragma once

#include <array>
#include <cstddef>

#include "voxel/lattice/simd8.h"
#include "voxel/lattice/simd_dispatch.h"

namespace voxel::composite {

// A row as coarse ones have it: `rows` are those that weigh, from the coarse lane on by which lane 0 goes.
struct ProlongArgs {
  std::array<const float*, 4> rows;
  std::array<float, 4> weights;
  int count = 0;
  bool odd = false;
  const float *along, *least, *most_negative, *is_free;  // bounds null: none
  float* u;
  int octets;
  bool adds;  // to nodes that follow; else all nodes become what is told
};
void prolong_row(const ProlongArgs& args) noexcept;

// The same by links. A row stands between two in y, in z, in both or in none.
struct ProlongByLinksArgs {
  std::array<const float*, 4> rows;  // of the coarser level; [0]: before in both, 1: after in y, 2: in z, 3
  std::array<const float*, 4> along_x;  // links in x of the fine rows that stand there
  // Links to the row before and after, of rows that stand between two in y (where before in z, after), in z.
  std::array<std::array<const float*, 2>, 2> along_y;
  std::array<const float*, 2> along_z;
  bool between_y, between_z;
};
void prolong_row_by_links(const ProlongArgs& args, const ProlongByLinksArgs& by) noexcept;

// What a coarse row is told: of up to nine rows, itself in the middle, what each node carries, shared as it
// is told. [z][y] before, own, after; null: nothing. Where a share is one half links decide how much it is.
struct RestrictArgs {
  std::array<std::array<const float*, 3>, 3> rows;
  std::array<float, 3> share_y, share_z;
  // Links to the row before and after.
  std::array<std::array<std::array<const float*, 2>, 3>, 3> along_z;  // [z][y]
  std::array<std::array<const float*, 2>, 3> along_y;                 // [y], own in z
  const float* along_x;                                               // of the own row
  int octets;
  // What nodes of the own row get of others across it; and of what a node in x gets, the share of the node
  // after it.
  float *sum, *part;
};
void restrict_row_by_links(const RestrictArgs& gathering) noexcept;

}  // namespace voxel::composite
