// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/holds.h"

#include <algorithm>

namespace voxel {
namespace {

constexpr float kImmovable = 1e4F;        // a hold: all of the cell is held
constexpr std::size_t kQueued = 65536;    // cells looked at together
constexpr std::size_t kMostOfAVoxel = 7;  // cells that change with a voxel: its own, its neighbours'

// Those of a cell's eight children, or voxels, that lie in the grid.
template <class Visit>
void for_children(const Grid& finer, const std::array<int, 3>& cell, const Visit& visit) {
  for (int corner = 0; corner < 8; ++corner) {
    const std::array<int, 3> child{2 * cell[0] + (corner & 1), 2 * cell[1] + (corner >> 1 & 1),
                                   2 * cell[2] + (corner >> 2)};
    if (child[0] < finer.dims[0] && child[1] < finer.dims[1] && child[2] < finer.dims[2])
      visit(finer.at(child[0], child[1], child[2]), child);
  }
}

// The link of a child to the other one of its cell on axis d.
Spring to_sibling(const VoxelSprings& springs, const std::array<int, 3>& child, std::size_t d) {
  return (child[d] & 1) != 0 ? springs.down[d] : springs.up[d];
}

}  // namespace

Holds::Holds(const Lattice& lattice, const std::vector<Couplings*>& levels)
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
    level.row_held = LazyArray<std::uint16_t>(g.rows());
    level.queued = LazyArray<std::uint8_t>(g.size());
  }
  for (RowId row = 0; row < lattice.grid().rows(); ++row) {
    if (lattice.filled_in(row) == 0) continue;
    for (VoxelId v = row * kRow; v < (row + 1) * kRow; ++v) {
      if (lattice.filled(v) && lattice.anchored(v)) look_at(v);
    }
  }
  renew();
}

void Holds::queue(int level, VoxelId cell) noexcept {
  Level& l = at(level);
  if (l.queued[cell] != 0) return;
  l.queued[cell] = 1;
  queue_[static_cast<std::size_t>(level & 1)].push_back(cell);
}

// What holds voxel v changed, and with that its cell and those of its neighbours.
void Holds::look_at(VoxelId v) noexcept {
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

void Holds::set_held(std::span<const VoxelId> held) noexcept {
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

void Holds::support(VoxelId v, const Parts& parts) noexcept {
  if (supported_[v] == parts) return;
  supported_[v] = parts;
  row_supported_[v / kRow] = 1;
  look_at(v);
}

void Holds::renew() noexcept {
  const int last = static_cast<int>(levels_.size()) - 1;
  for (int level = 1; level <= last; ++level) {
    auto& cells = queue_[static_cast<std::size_t>(level & 1)];
    for (const VoxelId cell : cells) {
      at(level).queued[cell] = 0;
      level == 1 ? renew_first(cell) : renew_above(level, cell);
      if (level == last) continue;
      const std::array<int, 3> c = at(level).couplings->grid().coordinates(cell);
      queue(level + 1, at(level + 1).couplings->grid().at(c[0] / 2, c[1] / 2, c[2] / 2));
    }
    cells.clear();
  }
}

// Voxels of a cell that are free, by their links to others that are not: in the same cell, these are half a
// link from its middle.
void Holds::renew_first(VoxelId cell) noexcept {
  const Grid& g = lattice_.grid();
  Couplings& couplings = *at(0).couplings;
  const std::array<int, 3> place = at(1).couplings->grid().coordinates(cell);
  Through through{};
  std::array<int, 3> held{};
  int count = 0;
  for_children(g, place, [&](VoxelId v, const std::array<int, 3>& c) {
    if (!lattice_.filled(v)) return;
    ++count;
    const Parts own = parts_of(v);
    for (std::size_t axis = 0; axis < 3; ++axis) held[axis] += own[axis] == kWhole ? 1 : 0;
    if (own == Parts{kWhole, kWhole, kWhole}) return;
    const VoxelSprings springs = couplings.springs_of(v);
    for (std::size_t d = 0; d < 3; ++d) {
      for (const bool up : {false, true}) {
        const Parts other = parts_of(up ? g.up(v, static_cast<int>(d)) : g.down(v, static_cast<int>(d)));
        if (other == Parts{}) continue;
        const bool within = up == ((c[d] & 1) == 0);
        const Spring& link = up ? springs.up[d] : springs.down[d];
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const float share = static_cast<float>(other[axis]) * static_cast<float>(kWhole - own[axis]) /
                              static_cast<float>(kWhole * kWhole);
          through[axis][d] +=
              (within ? 2.0F : 1.0F) * share * link.on(static_cast<int>(axis), static_cast<int>(d));
        }
      }
    }
  });
  set(1, cell, place, through, {held[0] == count, held[1] == count, held[2] == count});
}

void Holds::renew_above(int level, VoxelId cell) noexcept {
  Level& finer = at(level - 1);
  const std::array<int, 3> place = at(level).couplings->grid().coordinates(cell);
  const auto size = static_cast<float>(1 << level);
  Through through{};
  std::array<int, 3> held{};
  int count = 0;
  for_children(finer.couplings->grid(), place, [&](VoxelId w, const std::array<int, 3>& c) {
    if (!finer.couplings->prepare(w / kRow) || finer.couplings->filled(w / kRow)[w % kRow] == 0.0F) return;
    ++count;
    const VoxelSprings springs = finer.couplings->springs_of(w);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const bool all = springs.inverse[axis] == 0.0F || finer.hold[axis][w] == kImmovable;
      held[axis] += all ? 1 : 0;
      for (std::size_t d = 0; d < 3; ++d) {
        const float k = to_sibling(springs, c, d).on(static_cast<int>(axis), static_cast<int>(d));
        const float own = finer.through[axis][d][w];
        if (all) {  // up to the middle of this one, but for half a voxel
          through[axis][d] += size * k;
        } else if (own > 0.0F) {
          through[axis][d] += k > 0.0F ? 2.0F * k * own / (2.0F * k + own) : own;
        }
      }
    }
  });
  set(level, cell, place, through, {held[0] == count, held[1] == count, held[2] == count});
}

void Holds::set(int level, VoxelId cell, const std::array<int, 3>& place, const Through& through,
                const std::array<bool, 3>& immovable) noexcept {
  Level& l = at(level);
  const VoxelSprings own = l.couplings->springs_of(cell);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    float sum = 0.0F, nearer = 0.0F;
    for (std::size_t d = 0; d < 3; ++d) {
      l.through[axis][d][cell] = through[axis][d];
      sum += through[axis][d];
      const float k = to_sibling(own, place, d).on(static_cast<int>(axis), static_cast<int>(d));
      if (k > 0.0F) nearer += through[axis][d] / (2.0F * k);
    }
    const float hold = immovable[axis] ? kImmovable : std::min(sum * own.inverse[axis], kImmovable);
    float& now = l.hold[axis][cell];
    if ((now != 0.0F) != (hold != 0.0F)) l.row_held[cell / kRow] += hold != 0.0F ? 1 : -1;
    now = hold;
    l.nearer[axis][cell] = nearer;
  }
}

void Holds::populate() noexcept {
  held_mark_.populate();
  supported_.populate();
  for (Level& l : levels_) {
    l.queued.populate();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (auto& d : l.through[axis]) d.populate();
      l.hold[axis].populate();
      l.nearer[axis].populate();
    }
  }
}

std::size_t Holds::memory_bytes() const {
  std::size_t bytes = held_.capacity() * sizeof(VoxelId) + held_mark_.resident_bytes() +
                      supported_.resident_bytes() + row_supported_.resident_bytes();
  for (const auto& cells : queue_) bytes += cells.capacity() * sizeof(VoxelId);
  for (const Level& l : levels_) {
    bytes += l.row_held.resident_bytes() + l.queued.resident_bytes();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (const auto& d : l.through[axis]) bytes += d.resident_bytes();
      bytes += l.hold[axis].resident_bytes() + l.nearer[axis].resident_bytes();
    }
  }
  return bytes;
}

}  // namespace voxel
