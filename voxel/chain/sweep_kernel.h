// SPDX-License-Identifier: GPL-3.0-or-later
// Innermost loop of a sweep (wave_sweep.cpp): relaxes, on one axis, the links to a strip of rows from the
// rows before them in y, z and x. A strip is a sequence of rows consecutive in y; "before" is the side that
// the sweep comes from.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "voxel/chain/row_kernels.h"

namespace voxel {

inline constexpr std::uint32_t kFullRow = 0xFFFFFFFFU;  // RowInfo::free of a row of free voxels

// The data that decide how a row is relaxed. They lie together in memory, because one visit reads the data of
// several rows.
struct RowInfo {
  std::uint32_t free = 0;     // bit of each lane: a voxel that is not anchored
  std::uint8_t label = 0;     // label of a row that is full of free voxels of one label; else 0
  bool filled : 1 = false;    // has any voxel
  bool anchored : 1 = false;  // has any anchor
  bool known : 1 = false;     // the fields above are set
  std::uint8_t mark = 0;      // ChainWave::Mark bits
  std::uint8_t waits = 0;     // bit of each wave that has yet to relax this row's links; ChainWave::kListed
};
static_assert(sizeof(RowInfo) == 8);

// Rows at equal distances in memory; each pointer is to the first of them.
struct RowStrip {
  float* u = nullptr;  // null: no rows
  const std::uint8_t* labels = nullptr;
  const RowInfo* info = nullptr;
};

// Half limits by label of the links between a row and the row before it: into the row (`in`), and in reverse
// (`back`).
struct LinkHalves {
  const float* in = nullptr;
  const float* back = nullptr;
};

// Bits: the neighbours of a row that have moved and whose links to the row are yet to be relaxed.
enum Pending : std::uint8_t {
  kFromBelowY = 1,  // the neighbour at y − 1
  kFromAboveY = 2,  // the neighbour at y + 1; likewise for x and z
  kFromBelowX = 4,
  kFromAboveX = 8,
  kFromBelowZ = 16,
  kFromAboveZ = 32,
};

struct SweepTask {
  RowStrip own, z, x;  // the strip, and the strips before it in z and x (u null: none)
  std::uint8_t* pending = nullptr;
  // Rows among the first `count` with one of these Pending bits are relaxed. So are rows among the first
  // `max_rows` that follow a moved row. Relaxed rows lose the bits.
  std::uint8_t mask = 0;
  int step = 1;  // rows from one to the next: 1 or −1
  int count = 0;
  int max_rows = 0;
  bool y = true;  // relax the links from the row before in y, too
  LinkHalves along_y, along_z, along_x;
  const float* up = nullptr;  // half limits within the row, as in raise_along()
  const float* down = nullptr;
  int registers = 1;
  bool x_above = false;  // the strip before in x is on the side of the last lane, not of the first
  float margin = 0.0F;
};

// Further bits of Moved: the row's move requires a move of the row before it in y, in z, in x.
inline constexpr Moved kRevisitY = 8, kRevisitZ = 16, kRevisitX = 32;

struct SweepResult {
  int end = 0;     // rows that are done
  int visits = 0;  // rows that were relaxed
};
// Relax the rows of a task. moves[n]: Moved bits of row n, for the first `end` rows. The sweep ends early
// after `most_visits` visits. It also ends before a row if that row, or a row before it in y, z or x, has an
// anchor.
SweepResult sweep_raise(const SweepTask& task, int most_visits, Moved* moves) noexcept;
SweepResult sweep_lower(const SweepTask& task, int most_visits, Moved* moves) noexcept;

// sweep_raise() and sweep_lower() for each register width that this processor has, the narrowest first. The
// functions above use the last pair. All pairs give the same bits.
struct SweepKernels {
  SweepResult (*raise)(const SweepTask&, int, Moved*);
  SweepResult (*lower)(const SweepTask&, int, Moved*);
};
std::span<const SweepKernels> sweep_kernels() noexcept;

}  // namespace voxel
