// SPDX-License-Identifier: GPL-3.0-or-later
// Of ChainWave: cones in closed form.
#include <algorithm>

#include "voxel/chain_rows.h"
#include "voxel/chain_wave.h"

namespace voxel {
namespace {

constexpr std::uint32_t kAll = 0xFFFFFFFFU;

}  // namespace

// How far a cone gets along the three lines through its apex. Where nothing but free voxels is within, those
// at which it ends included, it raises nothing beyond: what it raises there, it raises all along every
// shortest way to it, and one of these leads over such a line.
ChainWave::Box ChainWave::reach(const Pass& p, VoxelId apex) noexcept {
  Box box;
  const Grid& grid = lattice_.grid();
  for (int n = 0; n < kWays; ++n) {
    const auto un = static_cast<std::size_t>(n);
    const double limit = p.limit[un];
    VoxelId v = apex;
    for (int k = 1;; ++k) {
      v = n % 2 == 0 ? grid.up(v, n / 2) : grid.down(v, n / 2);
      box.cut[un] = !free(v);
      if (box.cut[un]) break;
      const double by =
          (static_cast<double>(p.u[apex]) - static_cast<double>(p.u[v])) * (p.way == Way::raise ? 1.0 : -1.0);
      if (by - k * limit <= static_cast<double>(p.margin)) break;
      ++box.steps[un];
    }
  }
  return box;
}

bool ChainWave::full(const std::array<int, 3>& low, const std::array<int, 3>& high) noexcept {
  if (free_is_box_) return true;
  const Grid& grid = lattice_.grid();
  for (int c = low[0] / kRow + 1; c <= high[0] / kRow + 1; ++c) {
    const int x = (c - 1) * kRow;
    std::uint32_t needed = kAll;
    if (low[0] > x) needed &= kAll << (low[0] - x);
    if (high[0] < x + kRow - 1) needed &= kAll >> (x + kRow - 1 - high[0]);
    for (int z = low[2]; z <= high[2]; ++z) {
      const RowInfo* const row = &info(grid.row(c, low[1], z));
      std::uint32_t all = kAll;
      for (int n = 0; n <= high[1] - low[1]; ++n) all &= row[n].free;
      if ((all & needed) != needed) return false;
    }
  }
  return true;
}

bool ChainWave::cone(const Pass& p, VoxelId apex, std::uint64_t most) noexcept {
  if (lattice_.anchored(apex)) return false;
  const Box box = reach(p, apex);
  const std::array<int, 3> at = lattice_.coordinates(apex);
  std::array<int, 3> low{}, high{};
  for (std::size_t d = 0; d < 3; ++d) {
    // With the first voxels that it does not raise: only if there is no gap among these does it end there.
    low[d] = at[d] - box.steps[2 * d + 1] - (box.cut[2 * d + 1] ? 0 : 1);
    high[d] = at[d] + box.steps[2 * d] + (box.cut[2 * d] ? 0 : 1);
  }
  // An octahedron in this box takes no more than half of its rows.
  const auto size = [&](std::size_t d) { return static_cast<std::uint64_t>(high[d] - low[d]) + 1; };
  if ((size(0) / kRow + 2) * size(1) * size(2) / 2 / kConeRows > most || !full(low, high)) return false;
  write_cone(p, apex, box);
  enqueue_cut_faces(apex, box);
  return true;
}

// Rows of one column and one z, from `row` up and down in y; lane `nearest` is that nearest to the apex.
// Returns how many were raised; the apex's own counts as raised.
int ChainWave::write_column(const Pass& p, RowId row, int nearest, bool has_apex, const Box& box, double base,
                            const float* fall) noexcept {
  const auto write = p.way == Way::raise ? raise_cone : lower_cone;
  const double above = p.limit[2], below = p.limit[3], sign = p.way == Way::raise ? -1.0 : 1.0;
  const int up = box.steps[2], down = box.steps[3];
  const std::ptrdiff_t next = static_cast<std::ptrdiff_t>(lattice_.grid().row_z) * kRow;
  // Where the nearest lane is not raised none is, and beyond no row; so for each half of the row.
  int n = 0, m = 0;
  const int half = nearest / kCone * kCone;
  for (const int lanes : {half, kCone - half}) {
    const int near = lanes == half ? nearest - half : lanes > half ? 0 : kCone - 1;
    float* const at = row_at(p, row) + lanes;
    const float* const f = fall + lanes;
    const bool apex = has_apex && lanes == half;
    int raised = 0;
    if (apex) {
      raised = write({at, kRow, 1, next}, base, 0.0, f, near, -ChainLimits::kNoLink);
      raised += write({at + kRow, kRow, up, next}, base + sign * above, above, f, near, p.margin);
    } else {
      raised = write({at, kRow, up + 1, next}, base, above, f, near, p.margin);
      if (raised == 0) break;
    }
    const int back = write({at - kRow, -kRow, down, next}, base + sign * below, below, f, near, p.margin);
    n = std::max(n, raised);
    m = std::max(m, back);
  }
  note_moved(row - static_cast<RowId>(m), n + m);
  cone_rows_ += static_cast<std::uint64_t>(n + m);
  return n + m;
}

void ChainWave::write_cone(const Pass& p, VoxelId apex, const Box& box) noexcept {
  const Grid& grid = lattice_.grid();
  const std::array<int, 3> at = lattice_.coordinates(apex);
  const int low_x = at[0] - box.steps[1], high_x = at[0] + box.steps[0];
  const int column = at[0] / kRow + 1, low_column = low_x / kRow + 1, high_column = high_x / kRow + 1;
  for (int c = low_column; c <= high_column; ++c) {
    for (int i = 0; i < kRow; ++i) {
      const int x = (c - 1) * kRow + i;
      const double steps = x < at[0] ? at[0] - x : x - at[0];
      fall_[static_cast<std::size_t>(c) * kRow + static_cast<std::size_t>(i)] =
          x < low_x || x > high_x ? ChainLimits::kNoLink
                                  : static_cast<float>(steps * p.limit[x < at[0] ? 1 : 0]);
    }
  }
  const double sign = p.way == Way::raise ? -1.0 : 1.0, top = static_cast<double>(p.u[apex]);
  for (int k = -box.steps[5]; k <= box.steps[4]; ++k) {
    const double base = top + sign * (k < 0 ? -k * p.limit[5] : k * p.limit[4]);
    const auto line = [&](int c) {
      const int nearest = c == column ? at[0] % kRow : c > column ? 0 : kRow - 1;
      return write_column(p, grid.row(c, at[1], at[2] + k), nearest, k == 0 && c == column, box, base,
                          fall_.data() + static_cast<std::size_t>(c) * kRow);
    };
    for (int c = column; c <= high_column && line(c) > 0; ++c) {
    }
    for (int c = column - 1; c >= low_column && line(c) > 0; --c) {
    }
  }
}

// Where the box ends at something that is no free voxel, the wave may go on beside it, or pull an anchor.
void ChainWave::enqueue_cut_faces(VoxelId apex, const Box& box) noexcept {
  const Grid& grid = lattice_.grid();
  const std::array<int, 3> at = lattice_.coordinates(apex);
  for (int n = 0; n < kWays; ++n) {
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
