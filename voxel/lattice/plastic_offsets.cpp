// SPDX-License-Identifier: GPL-3.0-or-later
// Loads and offsets of yielded links, voxel by voxel.
#include "voxel/lattice/plastic_offsets.h"

#include <algorithm>
#include <cmath>

#include "voxel/lattice/displacement.h"
#include "voxel/lattice/lattice.h"
#include "voxel/lattice/level_stiffness.h"
#include "voxel/lattice/plasticity.h"

namespace voxel {

PlasticOffsets::PlasticOffsets(const Lattice& lattice) {
  if (!lattice.has_plasticity()) return;
  for (auto& d : offset) {
    for (auto& axis : d) axis = LazyArray<float>(lattice.size());
  }
  for (auto& axis : load) axis = LazyArray<float>(lattice.size());
  row = LazyArray<std::uint8_t>(lattice.grid().rows());
}

std::size_t PlasticOffsets::memory_bytes() const {
  std::size_t bytes = row.resident_bytes();
  for (const auto& d : offset) {
    for (const auto& axis : d) bytes += axis.resident_bytes();
  }
  for (const auto& axis : load) bytes += axis.resident_bytes();
  return bytes;
}

namespace {

// Calls `visit(d, axis, up, offset before, offset after, spring)` for each link of v, on each axis.
template <class Visit>
void for_links(const Lattice& lattice, const Displacement& state, VoxelId v, const VoxelSprings& springs,
               const Visit& visit) noexcept {
  const Grid& grid = lattice.grid();
  for (std::size_t d = 0; d < 3; ++d) {
    const int id = static_cast<int>(d);
    for (const bool up : {false, true}) {
      const VoxelId a = up ? v : grid.down(v, id), b = up ? grid.up(v, id) : v;
      if (!lattice.filled(up ? b : a)) continue;
      const float yield = lattice.yield_m(a, id);
      const Spring& spring = (up ? springs.up : springs.down)[d];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const LazyArray<float>& u = state.u[axis];
        const float before = state.plastic.offset_of(a, d, axis);
        const float after = plastic_link(u[b] - u[a], before, yield).offset;
        visit(d, axis, up, before, after, spring.on(static_cast<int>(axis), id));
      }
    }
  }
}

}  // namespace

std::array<float, 3> plastic_load(const Lattice& lattice, const Displacement& state,
                                  const VoxelSprings& springs, VoxelId v) noexcept {
  std::array<float, 3> load{};
  if (state.plastic.row.size() == 0 || !lattice.filled(v)) return load;
  for_links(lattice, state, v, springs,
            [&](std::size_t, std::size_t axis, bool up, float, float after, float spring) {
              load[axis] += (up ? -after : after) * spring;
            });
  return load;
}

RowPlasticity plastic_row(LevelStiffness& couplings, Displacement& state, RowId row, bool keep) noexcept {
  const Lattice& lattice = couplings.lattice();
  PlasticOffsets& rest = state.plastic;
  RowPlasticity out;
  for (VoxelId v = row * kRow; v < (row + 1) * kRow; ++v) {
    if (!lattice.filled(v)) continue;
    const VoxelSprings springs = couplings.springs_of(v);
    std::array<float, 3> load{};
    for_links(lattice, state, v, springs,
              [&](std::size_t d, std::size_t axis, bool up, float before, float after, float spring) {
                load[axis] += (up ? -after : after) * spring;
                if (after == before) return;
                if (!keep) {
                  out.uncommitted = true;
                } else if (up) {
                  rest.offset[d][axis][v] = after;
                }
              });
    for (std::size_t axis = 0; axis < 3; ++axis) {
      float& known = rest.load[axis][v];
      if (load[axis] == known) continue;
      out.moved_m = std::max(out.moved_m, std::fabs(load[axis] - known) * springs.inverse[axis]);
      known = load[axis];
      rest.row[row] = 1;
    }
  }
  return out;
}

}  // namespace voxel
