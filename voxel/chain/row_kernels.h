// SPDX-License-Identifier: GPL-3.0-or-later
// The innermost loops of the chain: one axis of one row at a time, in vectors. Each function comes as raise_…
// and lower_…, its mirror image: raising, a voxel goes up to its neighbour minus the link's limit.
//
// `margin` (unit: meter) is the rounding that states carry from earlier waves: what asks for no more moves
// nothing, or else every wave would mend the last bits of every one before it.
#pragma once

#include <cstddef>
#include <cstdint>

#include "voxel/lattice/row_grid.h"

namespace voxel {

// Half limits by label; see ChainLimits.
struct HalfLimits {
  const float* table;
  int registers;  // of eight values that hold the table up to its greatest label in use; 0: more than two
};

// What of a row moved: any voxel, its first one, its last one.
using Moved = std::uint8_t;
inline constexpr Moved kNothingMoved = 0, kAnyMoved = 1, kFirstMoved = 2, kLastMoved = 4;

// What row `from` asks of row `to` beside it; by labels, or with one limit for all links.
Moved raise_beside(const float* from, const std::uint8_t* from_labels, float* to,
                   const std::uint8_t* to_labels, const HalfLimits& half, float margin) noexcept;
Moved lower_beside(const float* from, const std::uint8_t* from_labels, float* to,
                   const std::uint8_t* to_labels, const HalfLimits& half, float margin) noexcept;
Moved raise_beside_alike(const float* from, float* to, float limit, float margin) noexcept;
Moved lower_beside_alike(const float* from, float* to, float limit, float margin) noexcept;

// What the voxels of a row ask of one another, until nothing is asked. `up`: limits of the links as the lower
// voxel asks, `down`: as the upper one does. Reads, and makes no use of, one value and label beyond both
// ends.
Moved raise_along(float* row, const std::uint8_t* labels, const HalfLimits& up, const HalfLimits& down,
                  float margin) noexcept;
Moved lower_along(float* row, const std::uint8_t* labels, const HalfLimits& up, const HalfLimits& down,
                  float margin) noexcept;
Moved raise_along_alike(float* row, float up, float down, float margin) noexcept;
Moved lower_along_alike(float* row, float up, float down, float margin) noexcept;

// A cone over one column of rows that follow one another in y: lane i of row n gets at least
// apex + n·by − fall[i], raised; n is 0 in the row of the cone's apex, and it falls both ways from there.
// Each half of a row is a line of the cache, and ends before the first row in which its lane with the least
// fall is not raised by more than the margin. Where no link was violated, it is raised the less the further
// it is from the apex, so that is looked for from where it is thought to be.
struct ConeColumn {
  float* own = nullptr;     // row 0
  std::ptrdiff_t next = 0;  // from a row to that which is asked for soon, and fetched meanwhile (unit: float)
  int up = 0, down = 0;     // rows beyond the own one, at most
  double apex = 0.0;        // how far the own row goes at most (unit: meter)
  double by_up = 0.0, by_down = 0.0;  // a row: of those with n above 0, below
  const float* fall = nullptr;        // [kRow]
  int nearest = 0;                    // the lane with the least fall
  bool has_apex = false;              // that lane's half of the own row counts as raised
};
// Rows that are raised beyond the own one: of the half with the nearest lane, of the other, at most as many.
// In the same order first where they are thought to end.
struct ConeEnds {
  int near_up = 0, near_down = 0, far_up = 0, far_down = 0;
};
// False: the own row is not raised, and none is.
bool raise_cone(const ConeColumn& column, float margin, ConeEnds& ends) noexcept;
bool lower_cone(const ConeColumn& column, float margin, ConeEnds& ends) noexcept;

}  // namespace voxel
