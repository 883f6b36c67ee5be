// SPDX-License-Identifier: GPL-3.0-or-later
// What yielded links keep, and how they pull meanwhile.
//
// A step goes from one state of rest to the next. Within it a link beyond its yield pulls no harder, which is
// an extra load on its two ends; the state of rest is that of the convex energy of
// voxel/lattice/plasticity.h, whatever the way there. When it is reached, the offsets are moved.
#pragma once

#include <array>
#include <cstdint>

#include "voxel/lattice/lazy_array.h"
#include "voxel/lattice/row_grid.h"

namespace voxel {

class LevelStiffness;
class Lattice;
struct Displacement;
struct VoxelSprings;

struct RestOffsets {
  RestOffsets() = default;
  // Takes no memory where nothing has yielded, and no address space where nothing can.
  explicit RestOffsets(const Lattice& lattice);

  // [d][axis][v]: rest difference of the link v → up(v, d) since the last state of rest (m).
  std::array<std::array<LazyArray<float>, 3>, 3> offset;
  // [axis][v]: what offsets, and yielding since, add to the force of the springs (N).
  std::array<LazyArray<float>, 3> load;
  LazyArray<std::uint8_t> row;  // [row] 1 where any of its links has yielded

  // Null where there is none.
  [[nodiscard]] const float* load_of(RowId r, int axis) const noexcept {
    if (row.size() == 0 || row[r] == 0) return nullptr;
    return load[static_cast<std::size_t>(axis)].data() + static_cast<std::size_t>(r) * kRow;
  }
  [[nodiscard]] float offset_of(VoxelId v, std::size_t d, std::size_t axis) const noexcept {
    return row.size() == 0 || row[v / kRow] == 0 ? 0.0F : offset[d][axis][v];
  }
  [[nodiscard]] std::size_t memory_bytes() const;
};

// What offsets, and yielding, add to the force of its springs on a voxel where it and its neighbours are now
// (N, per axis). Rows keep what they were told last; a contact wants to know it now, or a held tool and its
// tissue answer one another's last round for ever.
std::array<float, 3> plastic_load(const Lattice& lattice, const Displacement& state,
                                  const VoxelSprings& springs, VoxelId v) noexcept;

struct RowPlasticity {
  float moved_m = 0.0F;  // how far the change of its load would move a voxel of the row
  bool unkept = false;   // some link is beyond what it keeps
};

// Renews the loads of a row; `keep`: its links also keep what is beyond their yield. `couplings`: of level 0.
RowPlasticity plastic_row(LevelStiffness& couplings, Displacement& state, RowId row, bool keep) noexcept;

}  // namespace voxel
