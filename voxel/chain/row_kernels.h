// SPDX-License-Identifier: GPL-3.0-or-later
// Innermost loops of the chain: relaxation of the links of one row on one axis, in vectors.
//
// Relaxing a link (as in Bellman-Ford) moves one of its voxels as far as the link's limit requires, given the
// other voxel. Each function comes as raise_… and as lower_…, its mirror image. A raised voxel goes up to its
// neighbour's displacement minus the limit.
//
// `margin` (m) is the rounding that a state carries from earlier waves. A required move of at most the margin
// is not made. Otherwise every wave would correct the last bits of all waves before it.
#pragma once

#include <cstddef>
#include <cstdint>

#include "voxel/lattice/row_grid.h"

namespace voxel {

// A limit or displacement that never requires anything, such as the half limit of a label without voxels (m).
inline constexpr float kUnbounded = 1e30F;

// Half limits by label; see ChainLimits.
struct HalfLimits {
  const float* table;
  int registers;  // registers of 8 floats that hold the table up to the largest label in use: 1, 2, or 0 for
                  // more
};

// Bits: some voxel of the row moved; its first one moved; its last one moved.
using Moved = std::uint8_t;
inline constexpr Moved kNothingMoved = 0, kAnyMoved = 1, kFirstMoved = 2, kLastMoved = 4;

// Relaxes the links from row `from` to row `to` beside it: by labels, or with one limit for all links.
Moved raise_beside(const float* from, const std::uint8_t* from_labels, float* to,
                   const std::uint8_t* to_labels, const HalfLimits& half, float margin) noexcept;
Moved lower_beside(const float* from, const std::uint8_t* from_labels, float* to,
                   const std::uint8_t* to_labels, const HalfLimits& half, float margin) noexcept;
Moved raise_beside_alike(const float* from, float* to, float limit, float margin) noexcept;
Moved lower_beside_alike(const float* from, float* to, float limit, float margin) noexcept;

// Relaxes the links within a row until no voxel moves. `up`: limits from the lower voxel of a link to the
// upper one, `down`: the reverse. Reads one value and label beyond both ends, without effect.
Moved raise_along(float* row, const std::uint8_t* labels, const HalfLimits& up, const HalfLimits& down,
                  float margin) noexcept;
Moved lower_along(float* row, const std::uint8_t* labels, const HalfLimits& up, const HalfLimits& down,
                  float margin) noexcept;
Moved raise_along_alike(float* row, float up, float down, float margin) noexcept;
Moved lower_along_alike(float* row, float up, float down, float margin) noexcept;

// The part of a cone (wave.h) in one column of rows that are consecutive in y. Row 0 is the row at the y of
// the cone's apex. A raising cone raises lane i of row n to at least apex + n·slope − fall[i], where fall[i]
// is the fall within a row. Each half of the rows (a cache line of each row) has an end of its own: it ends
// before the first row in which the half's lane with the least fall is not raised by more than the margin. If
// no link was violated before, voxels further from the apex are raised less, so the search for this row can
// start at a guess.
struct ConeColumn {
  float* own = nullptr;                     // row 0
  std::ptrdiff_t next = 0;                  // offset from a row to the one to prefetch (floats)
  int up = 0, down = 0;                     // greatest numbers of rows above and below row 0
  double apex = 0.0;                        // the cone's value in row 0 without fall (m)
  double slope_up = 0.0, slope_down = 0.0;  // change per row for n > 0, for n < 0 (m)
  const float* fall = nullptr;              // [kRow] (m), >= 0
  int nearest = 0;                          // the lane with the least fall
  bool has_apex = false;                    // the half of row 0 with this lane counts as raised
};
// Numbers of rows raised above and below row 0: in the half with the nearest lane (near), and in the other
// half (far; never more than near). As input they are guesses.
struct ConeEnds {
  int near_up = 0, near_down = 0, far_up = 0, far_down = 0;
};
// False if row 0 is not raised; then no row is.
bool raise_cone(const ConeColumn& column, float margin, ConeEnds& ends) noexcept;
bool lower_cone(const ConeColumn& column, float margin, ConeEnds& ends) noexcept;

}  // namespace voxel
