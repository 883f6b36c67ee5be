// SPDX-License-Identifier: GPL-3.0-or-later
// Cones of ChainWave, written in closed form.
#include <algorithm>
#include <cstdlib>

#include "voxel/chain/row_kernels.h"
#include "voxel/chain/wave.h"

namespace voxel {
// Extent of a cone along the three lines through its apex. If the box of these extents, with one voxel beyond
// each end, holds free voxels only, the cone raises nothing outside. The reason: if a voxel is raised, so are
// all voxels on every shortest path to it. One shortest path to a voxel outside first follows one of the
// lines beyond its end, where no voxel is raised. The ends must not be found by bisection: where a cone lies
// on an older one, rounding decides which voxels are raised.
ChainWave::ConeBox ChainWave::cone_box(const WaveArgs& p, VoxelId apex) noexcept {
  ConeBox box;
  const Grid& grid = lattice_.grid();
  const std::array<int, 3> at = lattice_.coordinates(apex);
  for (int n = 0; n < kDirections; ++n) {
    const auto un = static_cast<std::size_t>(n), d = un / 2;
    const double limit = p.limit[un];
    const int most = n % 2 == 0 ? free_high_[d] - at[d] : at[d] - free_low_[d];
    VoxelId v = apex;
    for (int k = 1;; ++k) {
      v = n % 2 == 0 ? grid.up(v, n / 2) : grid.down(v, n / 2);
      box.cut[un] = free_is_box_ ? k > most : !free(v);
      if (box.cut[un]) break;
      const double by =
          (static_cast<double>(p.u[apex]) - static_cast<double>(p.u[v])) * (p.way == Way::raise ? 1.0 : -1.0);
      if (by - k * limit <= static_cast<double>(p.margin)) break;
      ++box.steps[un];
    }
  }
  return box;
}

bool ChainWave::is_full(const std::array<int, 3>& low, const std::array<int, 3>& high) noexcept {
  if (free_is_box_) return true;
  const Grid& grid = lattice_.grid();
  for (int c = low[0] / kRow + 1; c <= high[0] / kRow + 1; ++c) {
    const int x = (c - 1) * kRow;
    std::uint32_t needed = kFullRow;
    if (low[0] > x) needed &= kFullRow << (low[0] - x);
    if (high[0] < x + kRow - 1) needed &= kFullRow >> (x + kRow - 1 - high[0]);
    for (int z = low[2]; z <= high[2]; ++z) {
      const RowInfo* const row = &info(grid.row(c, low[1], z));
      std::uint32_t all = kFullRow;
      for (int n = 0; n <= high[1] - low[1]; ++n) all &= row[n].free;
      if ((all & needed) != needed) return false;
    }
  }
  return true;
}

bool ChainWave::cone(const WaveArgs& p, VoxelId apex, std::uint64_t most) noexcept {
  if (lattice_.anchored(apex)) return false;
  const ConeBox box = cone_box(p, apex);
  const std::array<int, 3> at = lattice_.coordinates(apex);
  std::array<int, 3> low{}, high{};
  for (std::size_t d = 0; d < 3; ++d) {
    // The box includes the first voxels that the cone does not raise. The cone ends there only if there is no
    // gap among them.
    low[d] = at[d] - box.steps[2 * d + 1] - (box.cut[2 * d + 1] ? 0 : 1);
    high[d] = at[d] + box.steps[2 * d] + (box.cut[2 * d] ? 0 : 1);
  }
  // The cone is an octahedron and takes at most half of the rows of this box.
  const auto size = [&](std::size_t d) { return static_cast<std::uint64_t>(high[d] - low[d]) + 1; };
  if ((size(0) / kRow + 2) * size(1) * size(2) / 2 / kConeRows > most || !is_full(low, high)) return false;
  write_cone(p, apex, box);
  enqueue_cut_faces(apex, box);
  return true;
}

// Writes column by column away from the apex, and within a column plane by plane, so that writes are nearly
// sequential in memory. If no row of a plane is raised, no plane beyond it is. If the apex plane of a column
// is not raised, no column beyond it is.
void ChainWave::write_cone(const WaveArgs& p, VoxelId apex, const ConeBox& box) noexcept {
  const Grid& grid = lattice_.grid();
  const std::array<int, 3> at = lattice_.coordinates(apex);
  const int low_x = at[0] - box.steps[1], high_x = at[0] + box.steps[0];
  const int own_column = at[0] / kRow + 1, low_column = low_x / kRow + 1, high_column = high_x / kRow + 1;
  for (int c = low_column; c <= high_column; ++c) {
    for (int i = 0; i < kRow; ++i) {
      const int x = (c - 1) * kRow + i;
      const double steps = x < at[0] ? at[0] - x : x - at[0];
      fall_[static_cast<std::size_t>(c) * kRow + static_cast<std::size_t>(i)] =
          x < low_x || x > high_x ? kUnbounded : static_cast<float>(steps * p.limit[x < at[0] ? 1 : 0]);
    }
  }
  const auto write = p.way == Way::raise ? raise_cone : lower_cone;
  const double sign = p.way == Way::raise ? -1.0 : 1.0, top = static_cast<double>(p.u[apex]);
  ConeColumn column{.up = box.steps[2],
                    .down = box.steps[3],
                    .slope_up = sign * p.limit[2],
                    .slope_down = -sign * p.limit[3]};
  // Writes plane k of column c. `next`: direction of the plane after it.
  const auto write_plane = [&](int c, int k, int next, ConeEnds& ends) {
    const RowId row = grid.row(c, at[1], at[2] + k);
    column.own = row_at(p, row);
    column.next = next * static_cast<std::ptrdiff_t>(grid.row_z) * kRow;
    column.apex = top + sign * std::abs(k) * p.limit[k < 0 ? 5 : 4];
    column.has_apex = k == 0 && c == own_column;
    if (!write(column, p.margin, ends)) return false;
    const auto rows = static_cast<RowId>(ends.near_down + 1 + ends.near_up);
    moved_.add(row - static_cast<RowId>(ends.near_down), rows);
    cone_rows_ += rows;
    return true;
  };
  const auto fewer = [](const ConeEnds& ends, int by) {
    return ConeEnds{ends.near_up - by, ends.near_down - by, ends.far_up - by, ends.far_down - by};
  };
  // Writes column c. `ends`: ends of the column's apex plane; as input a guess.
  const auto write_column = [&](int c, ConeEnds& ends) {
    column.fall = fall_.data() + static_cast<std::size_t>(c) * kRow;
    column.nearest = c == own_column ? at[0] % kRow : c > own_column ? 0 : kRow - 1;
    if (!write_plane(c, 0, box.steps[4] > 0 ? 1 : -1, ends)) return false;
    for (const int by : {1, -1}) {
      ConeEnds here = ends;  // guess: each plane ends one row earlier than the plane before it
      for (int k = 1; k <= box.steps[by > 0 ? 4 : 5]; ++k) {
        here = fewer(here, 1);
        if (!write_plane(c, by * k, by, here)) break;
      }
    }
    return true;
  };
  ConeEnds own{box.steps[2], box.steps[3], box.steps[2], box.steps[3]};
  if (!write_column(own_column, own)) return;
  for (const int by : {1, -1}) {
    ConeEnds ends = own;
    for (int c = own_column + by; c >= low_column && c <= high_column; c += by) {
      // Guess: each plane ends kRow / 2 rows earlier than the far ends of the column before it.
      ends = fewer({ends.far_up, ends.far_down, ends.far_up, ends.far_down}, kRow / 2);
      if (!write_column(c, ends)) break;
    }
  }
}

// Where the box ends at a voxel that is not free, the wave may continue round that voxel or pull an anchor.
// So the rows there are queued.
void ChainWave::enqueue_cut_faces(VoxelId apex, const ConeBox& box) noexcept {
  const Grid& grid = lattice_.grid();
  const std::array<int, 3> at = lattice_.coordinates(apex);
  for (int n = 0; n < kDirections; ++n) {
    const auto un = static_cast<std::size_t>(n), d = un / 2;
    if (!box.cut[un]) continue;
    std::array<int, 3> low{}, high{};
    for (std::size_t e = 0; e < 3; ++e) {
      low[e] = at[e] - box.steps[2 * e + 1];
      high[e] = at[e] + box.steps[2 * e];
    }
    (n % 2 == 0 ? low : high)[d] = (n % 2 == 0 ? high : low)[d];
    const int beyond = n % 2 == 0 ? 1 : -1;
    for (int c = low[0] / kRow + 1; c <= high[0] / kRow + 1; ++c) {
      for (int z = low[2]; z <= high[2]; ++z) {
        for (int y = low[1]; y <= high[1]; ++y) {
          std::array<int, 3> other{0, y, z};
          if (d > 0) other[d] += beyond;
          const bool something = d == 0 ? lattice_.filled(grid.at(low[0] + beyond, y, z))
                                        : info(grid.row(c, other[1], other[2])).filled;
          if (something) enqueue(grid.row(c, y, z));
        }
      }
    }
  }
}

}  // namespace voxel
