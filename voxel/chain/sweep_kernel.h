// SPDX-License-Identifier: GPL-3.0-or-later
// The innermost loop of a sweep: on one axis, rows that follow one another in y take what the rows before
// them ask, those before in y, in z and in x.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "voxel/chain/row_kernels.h"

namespace voxel {

// What decides how a row is dealt with, together, since one visit looks at several of them.
struct RowInfo {
  std::uint32_t free = 0;     // bit of each lane
  std::uint8_t label = 0;     // of a row full of free voxels of one label; else 0
  bool filled : 1 = false;    // has any voxel
  bool anchored : 1 = false;  // has any anchor
  bool known : 1 = false;     // all of this was looked up
  std::uint8_t mark = 0;      // ChainWave::Mark bits
  std::uint8_t waits = 0;     // bit of each wave that is still to ask from here; ChainWave::kListed
};
static_assert(sizeof(RowInfo) == 8);

// Rows that the same number of rows separates from one another.
struct RowStrip {
  float* u = nullptr;  // null: none
  const std::uint8_t* labels = nullptr;
  const RowInfo* info = nullptr;
};

// Half limits by label, of links as the row asks that the wave comes from, and as it is asked in turn.
struct PullHalves {
  const float* in = nullptr;
  const float* back = nullptr;
};

// What a row that is asked is asked by: bits.
enum Asked : std::uint8_t {
  kFromBelowY = 1,  // the row before it in y; the one after it; and so on
  kFromAboveY = 2,
  kFromBelowX = 4,
  kFromAboveX = 8,
  kFromBelowZ = 16,
  kFromAboveZ = 32,
};

struct Pull {
  RowStrip own, z, x;  // z.u, x.u null: nobody asks from there
  std::uint8_t* asked = nullptr;
  std::uint8_t by = 0;  // rows that have one of these bits are dealt with, and lose them …
  int step = 1;         // rows from one to the next: 1 or -1
  int count = 0;        // … among so many, and those that come after a row that moved
  int most = 0;         // but no row beyond these
  bool y = true;        // do the rows before them in y ask, too
  PullHalves along_y, along_z, along_x;
  const float* up = nullptr;  // between the row's own voxels, as in raise_along()
  const float* down = nullptr;
  int registers = 1;
  bool x_above = false;  // the row in x comes after the last voxel, not before the first one
  float margin = 0.0F;
};

// Further bits of Moved: it moved so far that the row before it in y, in z, in x is asked in turn.
inline constexpr Moved kAsksY = 8, kAsksZ = 16, kAsksX = 32;

struct Pulled {
  int end = 0;     // rows that need not be looked at again
  int visits = 0;  // those that were dealt with
};
// `moves`: what of each of these rows moved. Ends early before a row that has an anchor, or is asked by one
// that has, and after `most_visits`.
Pulled raise_pulled(const Pull& pull, int most_visits, Moved* moves) noexcept;
Pulled lower_pulled(const Pull& pull, int most_visits, Moved* moves) noexcept;

// The same for each width of registers that this processor has, narrow ones first: those above are the last.
// All give the same bits.
struct PullKernels {
  Pulled (*raise)(const Pull&, int, Moved*);
  Pulled (*lower)(const Pull&, int, Moved*);
};
std::span<const PullKernels> pull_kernels() noexcept;

}  // namespace voxel
