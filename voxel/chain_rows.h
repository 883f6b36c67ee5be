// SPDX-License-Identifier: GPL-3.0-or-later
// The innermost loops of the chain: one axis of one row at a time, in vectors. Each function comes as raise_…
// and lower_…, its mirror image: raising, a voxel goes up to its neighbour minus the link's limit.
//
// `margin` (unit: meter) is the rounding that states carry from earlier waves: what asks for no more moves
// nothing, or else every wave would mend the last bits of every one before it.
#pragma once

#include <cstddef>
#include <cstdint>

#include "voxel/grid.h"

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

// A cone over rows that follow one another, on kCone lanes of each: lane i of row n gets at least
// apex − n·per_row − fall[i]. Ends before the first row in which lane `nearest`, that with the least fall, is
// not raised by more than the margin; returns how many rows came before that.
inline constexpr int kCone = 16;  // a line of the cache
struct ConeRows {
  float* first;
  std::ptrdiff_t step;  // from one to the next (unit: float)
  int most;
  std::ptrdiff_t next;  // to that which is asked for soon, and fetched meanwhile (unit: float)
};
int raise_cone(const ConeRows& rows, double apex, double per_row, const float* fall, int nearest,
               float margin) noexcept;
int lower_cone(const ConeRows& rows, double apex, double per_row, const float* fall, int nearest,
               float margin) noexcept;

}  // namespace voxel
