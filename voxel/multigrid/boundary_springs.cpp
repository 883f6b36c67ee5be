// SPDX-License-Identifier: GPL-3.0-or-later
// Finds the cells with boundary springs. Cells near held and sliding voxels are queued. The springs of cells
// near anchors are found on first use.
#include "voxel/multigrid/boundary_springs.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>

namespace voxel {
namespace {

constexpr std::size_t kQueued = 65536;  // cells that the queue holds
// Cells that change with a voxel: its own and those of its neighbours.
constexpr std::size_t kMostOfAVoxel = 7;
// Lanes of a coarser row above the given lanes of the first of its two child rows along x.
std::uint32_t lanes_above(std::uint32_t lanes) {
  std::uint32_t out = 0;
  for (std::uint32_t rest = lanes; rest != 0;) {
    const int pair = std::countr_zero(rest) / 2;
    out |= 1U << pair;
    rest &= ~(3U << 2 * pair);
  }
  return out;
}

}  // namespace

BoundarySprings::BoundarySprings(const Lattice& lattice, const std::vector<LevelStiffness*>& levels)
    : lattice_(lattice),
      levels_(levels.size()),
      held_mark_(lattice.size()),
      supported_(lattice.size()),
      row_supported_(lattice.grid().rows()) {
  held_.reserve(lattice.surface().size());
  for (auto& cells : queue_) cells.reserve(kQueued);
  for (std::size_t n = 0; n < levels.size(); ++n) {
    Level& level = levels_[n];
    level.couplings = levels[n];
    if (n == 0) continue;
    const Grid& g = level.couplings->grid();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (auto& d : level.through[axis]) d = LazyArray<float>(g.size());
      level.hold[axis] = LazyArray<float>(g.size());
      level.nearer[axis] = LazyArray<float>(g.size());
    }
    for (auto& pair : level.tilt) pair = LazyArray<float>(g.size());
    level.row_held = LazyArray<std::uint8_t>(g.rows());
    level.row_tilted = LazyArray<std::uint8_t>(g.rows());
    level.queued = LazyArray<std::uint8_t>(g.size());
    level.found = LazyArray<std::uint32_t>(g.rows());
  }
  wait_for_anchors();
}

// On each level, marks the rows with a cell that anchors may fix.
void BoundarySprings::wait_for_anchors() {
  const auto above = [this](int level, RowId row) {
    const std::array<int, 3> c = at(level - 1).couplings->grid().row_coordinates(row);
    at(level).row_held[at(level).couplings->grid().row((c[0] - 1) / 2 + 1, c[1] / 2, c[2] / 2)] |= kWaits;
  };
  const Grid& g = lattice_.grid();
  for (RowId row = 0; row < g.rows(); ++row) {
    if (lattice_.anchored_lanes(row) == 0) continue;
    above(1, row);
    for (const RowId beside :
         {row - 1, row + 1, row - g.row_z, row + g.row_z, row - g.row_x, row + g.row_x}) {
      if (lattice_.filled_in(beside) != 0) above(1, beside);
    }
  }
  for (int level = 1; level < static_cast<int>(levels_.size()); ++level) {
    for (RowId row = 0; row < at(level).couplings->grid().rows(); ++row) {
      if (level + 1 < static_cast<int>(levels_.size()) && at(level).row_held[row] != 0) above(level + 1, row);
    }
    if (level >= LevelStiffness::kKept) keep_records(level);
  }
}

void BoundarySprings::keep_records(int level) {
  Level& l = at(level);
  for (RowId row = 0; row < l.couplings->grid().rows(); ++row) {
    if (l.row_held[row] == 0) continue;
    for (std::uint32_t lanes = cells_at_anchors(level, row); lanes != 0; lanes &= lanes - 1) {
      const auto cell = static_cast<VoxelId>(row * kRow + static_cast<RowId>(std::countr_zero(lanes)));
      Found found;
      Axes all{};
      find_above(level, cell, found, all);
      unsigned which = 0;
      const auto first = static_cast<std::uint32_t>(l.values.size());
      for (std::size_t axis = 0; axis < 3; ++axis) {
        for (std::size_t d = 0; d < 3; ++d) {
          if (found.through[axis][d] == 0.0F) continue;
          which |= 1U << (3 * axis + d);
          l.values.push_back(found.through[axis][d]);
        }
        which |= all[axis] ? 1U << (9 + axis) : 0U;
      }
      l.records.push_back({cell, first, static_cast<std::uint16_t>(which)});
    }
  }
  l.records.shrink_to_fit();
  l.values.shrink_to_fit();
}

// Lanes of voxels that are anchored or linked to an anchor.
std::uint32_t BoundarySprings::voxels_at_anchors(RowId row) const noexcept {
  const Grid& g = lattice_.grid();
  const std::uint32_t filled = lattice_.filled_lanes(row), own = lattice_.anchored_lanes(row);
  if (filled == 0) return 0;
  std::uint32_t lanes = own | own << 1U | own >> 1U;
  for (const RowId beside : {row - 1, row + 1, row - g.row_z, row + g.row_z})
    lanes |= lattice_.anchored_lanes(beside);
  lanes |= lattice_.anchored_lanes(row - g.row_x) >> (kRow - 1);
  lanes |= lattice_.anchored_lanes(row + g.row_x) << (kRow - 1);
  return lanes & filled;
}

// Lanes of the cells of a row that contain voxels_at_anchors().
std::uint32_t BoundarySprings::cells_at_anchors(int level, RowId row) const noexcept {
  const Grid& finer = at(level - 1).couplings->grid();
  const std::array<int, 3> c = at(level).couplings->grid().row_coordinates(row);
  std::uint32_t lanes = 0;
  for (int child = 0; child < 8; ++child) {
    const int half = child & 1, j = 2 * c[1] + (child >> 1 & 1), k = 2 * c[2] + (child >> 2);
    const int column = 2 * (c[0] - 1) + 1 + half;
    if (column + 1 >= finer.columns || j >= finer.dims[1] || k >= finer.dims[2]) continue;
    const RowId below = finer.row(column, j, k);
    std::uint32_t cells = 0;
    if (level > LevelStiffness::kKept) {
      for (const Record& record : records_in(level - 1, below)) cells |= 1U << record.cell % kRow;
    } else {
      cells = level == 1 ? voxels_at_anchors(below) : cells_at_anchors(level - 1, below);
    }
    lanes |= lanes_above(cells) << (half * kRow / 2);
  }
  return lanes;
}

std::span<const BoundarySprings::Record> BoundarySprings::records_in(int level, RowId row) const noexcept {
  const std::vector<Record>& records = at(level).records;
  const auto from = [&records](VoxelId cell) {
    return std::lower_bound(records.begin(), records.end(), cell,
                            [](const Record& r, VoxelId c) { return r.cell < c; });
  };
  return {from(row * kRow), from((row + 1) * kRow)};
}

BoundarySprings::Found BoundarySprings::recorded(int level, const Record& record) const noexcept {
  Found found;
  Axes all{};
  const float* value = at(level).values.data() + record.first;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t d = 0; d < 3; ++d) {
      if ((record.which >> (3 * axis + d) & 1U) != 0) found.through[axis][d] = *value++;
    }
    all[axis] = (record.which >> (9 + axis) & 1U) != 0;
  }
  complete(level, record.cell, all, found);
  return found;
}

// Springs of a cell in a waiting row, which are not stored yet.
BoundarySprings::Found BoundarySprings::waiting(int level, VoxelId cell) const noexcept {
  if (level < LevelStiffness::kKept) return find(level, cell);
  for (const Record& record : records_in(level, cell / kRow)) {
    if (record.cell == cell) return recorded(level, record);
  }
  return {};
}

void BoundarySprings::find_waiting(int level, RowId row) noexcept {
  Level& l = at(level);
  if (level >= LevelStiffness::kKept) {
    for (const Record& record : records_in(level, row)) {
      if (waits(level, record.cell)) set(level, record.cell, recorded(level, record));
    }
  } else {
    for (std::uint32_t lanes = cells_at_anchors(level, row) & ~l.found[row]; lanes != 0; lanes &= lanes - 1) {
      const auto cell = static_cast<VoxelId>(row * kRow + static_cast<RowId>(std::countr_zero(lanes)));
      set(level, cell, find(level, cell));
    }
  }
  l.row_held[row] &= static_cast<std::uint8_t>(~kWaits);
}

void BoundarySprings::queue(int level, VoxelId cell) noexcept {
  Level& l = at(level);
  if (l.queued[cell] != 0) return;
  l.queued[cell] = 1;
  queue_[static_cast<std::size_t>(level & 1)].push_back(cell);
}

// The support of voxel v changed: queues its cell and its neighbours' cells.
void BoundarySprings::look_at(VoxelId v) noexcept {
  if (queue_[1].size() + kMostOfAVoxel > queue_[1].capacity()) renew();
  const Grid &g = lattice_.grid(), &above = at(1).couplings->grid();
  const auto cell_of = [&](VoxelId w) {
    if (!lattice_.filled(w)) return;
    const std::array<int, 3> c = g.coordinates(w);
    queue(1, above.at(c[0] / 2, c[1] / 2, c[2] / 2));
  };
  cell_of(v);
  for (int d = 0; d < 3; ++d) {
    cell_of(g.up(v, d));
    cell_of(g.down(v, d));
  }
}

void BoundarySprings::set_held(std::span<const VoxelId> held) noexcept {
  if (std::equal(held.begin(), held.end(), held_.begin(), held_.end())) return;
  held = held.first(std::min(held.size(), held_.capacity()));
  constexpr std::uint8_t was = 1, stays = 2, is_new = 3;
  for (const VoxelId v : held) held_mark_[v] = held_mark_[v] == 0 || held_mark_[v] == is_new ? is_new : stays;
  for (const VoxelId v : held_) {
    if (held_mark_[v] != was) continue;
    held_mark_[v] = 0;
    look_at(v);
  }
  held_.assign(held.begin(), held.end());
  for (const VoxelId v : held_) {
    if (held_mark_[v] == is_new) look_at(v);
    held_mark_[v] = was;
  }
  renew();
}

BoundarySprings::Support BoundarySprings::along(const glm::vec3& normal, Support::By what) noexcept {
  Support by{what, {}};
  for (int axis = 0; axis < 3; ++axis)
    by.n[static_cast<std::size_t>(axis)] = static_cast<std::int8_t>(
        std::lround(static_cast<float>(kUnit) * std::clamp(normal[axis], -1.0F, 1.0F)));
  return by;
}

void BoundarySprings::support(VoxelId v, const Support& by) noexcept {
  if (supported_[v] == by) return;
  supported_[v] = by;
  row_supported_[v / kRow] = 1;
  look_at(v);
}

void BoundarySprings::renew() noexcept {
  const int last = static_cast<int>(levels_.size()) - 1;
  for (int level = 1; level <= last; ++level) {
    auto& cells = queue_[static_cast<std::size_t>(level & 1)];
    for (const VoxelId cell : cells) {
      at(level).queued[cell] = 0;
      renew(level, cell);
      if (level == last) continue;
      const std::array<int, 3> c = at(level).couplings->grid().coordinates(cell);
      queue(level + 1, at(level + 1).couplings->grid().at(c[0] / 2, c[1] / 2, c[2] / 2));
    }
    cells.clear();
  }
}

void BoundarySprings::prepare_all() noexcept {
  held_mark_.populate();
  supported_.populate();
  for (Level& l : levels_) {
    const std::vector<bool> rows = l.couplings->rows_in_use();
    l.queued.populate(kRow, rows);
    for (auto& pair : l.tilt) pair.populate(kRow, rows);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (auto& d : l.through[axis]) d.populate(kRow, rows);
      l.hold[axis].populate(kRow, rows);
      l.nearer[axis].populate(kRow, rows);
    }
  }
  for (int level = 1; level < static_cast<int>(levels_.size()); ++level) {
    for (RowId row = 0; row < at(level).couplings->grid().rows(); ++row) {
      if ((at(level).row_held[row] & kWaits) != 0) find_waiting(level, row);
    }
  }
}

std::size_t BoundarySprings::memory_bytes() const {
  std::size_t bytes = sizeof(*this) + resident_bytes(held_) + held_mark_.resident_bytes() +
                      supported_.resident_bytes() + row_supported_.resident_bytes();
  for (const auto& cells : queue_) bytes += resident_bytes(cells);
  for (const Level& l : levels_) {
    bytes += l.row_held.resident_bytes() + l.row_tilted.resident_bytes() + l.queued.resident_bytes() +
             l.found.resident_bytes() + resident_bytes(l.records) + resident_bytes(l.values);
    for (const auto& pair : l.tilt) bytes += pair.resident_bytes();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (const auto& d : l.through[axis]) bytes += d.resident_bytes();
      bytes += l.hold[axis].resident_bytes() + l.nearer[axis].resident_bytes();
    }
  }
  return bytes;
}

}  // namespace voxel
