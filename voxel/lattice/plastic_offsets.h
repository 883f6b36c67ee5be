// SPDX-License-Identifier: GPL-3.0-or-later
// Plastic offsets of yielded links, and their loads on voxels.
//
// A step leads from one state of rest to the next. Within a step the force of a link stays constant beyond
// its yield. Its difference from the spring's force is a load on the two ends of the link. The state of rest
// minimises the convex energy of voxel/lattice/plasticity.h and does not depend on the path. The offsets move
// when that state is reached.
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

struct PlasticOffsets {
  PlasticOffsets() = default;
  // Takes no memory for rows without a yielded link, and no address space if no link can yield.
  explicit PlasticOffsets(const Lattice& lattice);

  // [d][axis][v]: rest difference of the link v → up(v, d) since the last state of rest (m).
  std::array<std::array<LazyArray<float>, 3>, 3> offset;
  // [axis][v]: load on a voxel beyond the force of its springs, from the offsets and from yielding since the
  // last state of rest (N).
  std::array<LazyArray<float>, 3> load;
  LazyArray<std::uint8_t> row;  // [row] 1 if any of its links has yielded

  // Loads of a row on one axis (N); null: no load.
  [[nodiscard]] const float* load_of(RowId r, int axis) const noexcept {
    if (row.size() == 0 || row[r] == 0) return nullptr;
    return load[static_cast<std::size_t>(axis)].data() + static_cast<std::size_t>(r) * kRow;
  }
  [[nodiscard]] float offset_of(VoxelId v, std::size_t d, std::size_t axis) const noexcept {
    return row.size() == 0 || row[v / kRow] == 0 ? 0.0F : offset[d][axis][v];
  }
  [[nodiscard]] std::size_t memory_bytes() const;
};

// Plastic load on a voxel at the present displacements (N, per axis). The loads of rows date from their last
// renewal. A contact needs the present load: with the load of the last renewal, a held tool and its tissue
// would keep reacting to each other and never come to rest.
std::array<float, 3> plastic_load(const Lattice& lattice, const Displacement& state,
                                  const VoxelSprings& springs, VoxelId v) noexcept;

struct RowPlasticity {
  float moved_m = 0.0F;      // largest motion of a voxel of the row that the change of the loads causes
  bool uncommitted = false;  // some link is beyond its yield, and its offset has not moved
};

// Renews the loads of a row. `keep`: also moves the offsets of its yielded links. `couplings`: of level 0.
RowPlasticity plastic_row(LevelStiffness& couplings, Displacement& state, RowId row, bool keep) noexcept;

}  // namespace voxel
