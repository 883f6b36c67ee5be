// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/holds.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace voxel {
namespace {

constexpr float kImmovable = 1e4F;        // a hold: all of the cell is held
constexpr float kAllSlide = 16.0F;        // … all of it slides; of the voxels' own springs
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
    for (auto& pair : level.tilt) pair = LazyArray<float>(g.size());
    level.row_held = LazyArray<std::uint16_t>(g.rows());
    level.row_tilted = LazyArray<std::uint16_t>(g.rows());
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

Holds::Support Holds::along(const glm::vec3& normal) noexcept {
  Support by{Support::By::normal, {}};
  for (int axis = 0; axis < 3; ++axis)
    by.n[static_cast<std::size_t>(axis)] = static_cast<std::int8_t>(
        std::lround(static_cast<float>(kUnit) * std::clamp(normal[axis], -1.0F, 1.0F)));
  return by;
}

void Holds::support(VoxelId v, const Support& by) noexcept {
  if (supported_[v] == by) return;
  supported_[v] = by;
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

namespace {

// Pairs of axes, as tilt() has them.
constexpr std::array<std::array<std::size_t, 2>, 3> kPairs{{{0, 1}, {0, 2}, {1, 2}}};

// Of a voxel that is held as `own` is, what a link to one held as `other` keeps from moving: of each axis,
// and of pairs, in parts of the link's springs.
struct Kept {
  std::array<float, 3> axes, pairs;
};
Kept kept_by(const Holds::Support& own, const Holds::Support& other) {
  using By = Holds::Support::By;
  constexpr float unit = 1.0F / Holds::kUnit;
  const auto normal = [](const Holds::Support& s) { return glm::vec3(s.n[0], s.n[1], s.n[2]) * unit; };
  Kept kept{};
  if (other.by == By::all) {  // all that the voxel can do
    kept.axes = {1.0F, 1.0F, 1.0F};
    if (own.by != By::normal) return kept;
    const glm::vec3 n = normal(own);
    for (int axis = 0; axis < 3; ++axis)
      kept.axes[static_cast<std::size_t>(axis)] = std::max(0.0F, 1.0F - n[axis] * n[axis]);
    for (std::size_t p = 0; p < 3; ++p)
      kept.pairs[p] = -n[static_cast<int>(kPairs[p][0])] * n[static_cast<int>(kPairs[p][1])];
    return kept;
  }
  glm::vec3 n = normal(other);  // along which the other one stays, as far as this one can go that way
  if (own.by == By::normal) {
    const glm::vec3 stays = normal(own);
    n -= (n.x * stays.x + n.y * stays.y + n.z * stays.z) * stays;
  }
  for (int axis = 0; axis < 3; ++axis) kept.axes[static_cast<std::size_t>(axis)] = n[axis] * n[axis];
  for (std::size_t p = 0; p < 3; ++p)
    kept.pairs[p] = n[static_cast<int>(kPairs[p][0])] * n[static_cast<int>(kPairs[p][1])];
  return kept;
}

}  // namespace

// Voxels of a cell that are free, by their links to others that are not: in the same cell, these are half a
// link from its middle.
void Holds::renew_first(VoxelId cell) noexcept {
  const Grid& g = lattice_.grid();
  Couplings& couplings = *at(0).couplings;
  const std::array<int, 3> place = at(1).couplings->grid().coordinates(cell);
  Through through{};
  std::array<float, 3> tilt{}, all_along{}, all_across{};
  std::array<int, 3> held{};
  int count = 0, supported = 0;
  for_children(g, place, [&](VoxelId v, const std::array<int, 3>& c) {
    if (!lattice_.filled(v)) return;
    ++count;
    const Support own = support_of(v);
    const VoxelSprings springs = couplings.springs_of(v);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const bool stays =
          own.by == Support::By::all || (own.by == Support::By::normal && std::abs(own.n[axis]) == kUnit);
      held[axis] += stays ? 1 : 0;
    }
    supported += own.by == Support::By::nothing ? 0 : 1;
    if (own.by == Support::By::all) return;
    if (own.by == Support::By::normal) {
      constexpr float unit = 1.0F / (kUnit * kUnit);
      const auto k = [&springs](std::size_t axis) {
        return springs.inverse[axis] > 0.0F ? 1.0F / springs.inverse[axis] : 0.0F;
      };
      for (std::size_t axis = 0; axis < 3; ++axis)
        all_along[axis] += unit * static_cast<float>(own.n[axis] * own.n[axis]) * k(axis);
      for (std::size_t p = 0; p < 3; ++p) {
        const auto [a, b] = kPairs[p];
        all_across[p] += unit * static_cast<float>(own.n[a] * own.n[b]) * std::sqrt(k(a) * k(b));
      }
    }
    for (std::size_t d = 0; d < 3; ++d) {
      for (const bool up : {false, true}) {
        const Support other = support_of(up ? g.up(v, static_cast<int>(d)) : g.down(v, static_cast<int>(d)));
        if (other.by == Support::By::nothing) continue;
        const bool within = up == ((c[d] & 1) == 0);
        const Spring& link = up ? springs.up[d] : springs.down[d];
        const Kept kept = kept_by(own, other);
        const auto k = [&](std::size_t axis) {
          return (within ? 2.0F : 1.0F) * link.on(static_cast<int>(axis), static_cast<int>(d));
        };
        for (std::size_t axis = 0; axis < 3; ++axis) through[axis][d] += kept.axes[axis] * k(axis);
        for (std::size_t p = 0; p < 3; ++p)
          tilt[p] += kept.pairs[p] * std::sqrt(k(kPairs[p][0]) * k(kPairs[p][1]));
      }
    }
  });
  // Of voxels that all slide, no link says that they do not go along their normals.
  if (supported == count) {
    for (std::size_t axis = 0; axis < 3; ++axis) through[axis][axis] += kAllSlide * all_along[axis];
    for (std::size_t p = 0; p < 3; ++p) tilt[p] += kAllSlide * all_across[p];
  }
  set(1, cell, place, through, tilt, {held[0] == count, held[1] == count, held[2] == count});
}

void Holds::renew_above(int level, VoxelId cell) noexcept {
  Level& finer = at(level - 1);
  const std::array<int, 3> place = at(level).couplings->grid().coordinates(cell);
  const auto size = static_cast<float>(1 << level);
  Through through{};
  std::array<float, 3> tilt{};
  std::array<int, 3> held{};
  int count = 0;
  for_children(finer.couplings->grid(), place, [&](VoxelId w, const std::array<int, 3>& c) {
    if (!finer.couplings->prepare(w / kRow) || finer.couplings->filled(w / kRow)[w % kRow] == 0.0F) return;
    ++count;
    const VoxelSprings springs = finer.couplings->springs_of(w);
    std::array<float, 3> passed{};  // of what holds the child, that part holds this one
    for (std::size_t axis = 0; axis < 3; ++axis) {
      float before = 0.0F, after = 0.0F;
      const bool all = springs.inverse[axis] == 0.0F || finer.hold[axis][w] == kImmovable;
      held[axis] += all ? 1 : 0;
      for (std::size_t d = 0; d < 3; ++d) {
        const float k = to_sibling(springs, c, d).on(static_cast<int>(axis), static_cast<int>(d));
        const float own = finer.through[axis][d][w];
        if (all) {  // up to the middle of this one, but for half a voxel
          through[axis][d] += size * k;
        } else if (own > 0.0F) {
          const float series = k > 0.0F ? 2.0F * k * own / (2.0F * k + own) : own;
          through[axis][d] += series;
          before += own;
          after += series;
        }
      }
      if (before > 0.0F) passed[axis] = after / before;
    }
    for (std::size_t p = 0; p < 3; ++p) {
      if (finer.tilt[p][w] != 0.0F)
        tilt[p] += finer.tilt[p][w] * std::sqrt(passed[kPairs[p][0]] * passed[kPairs[p][1]]);
    }
  });
  set(level, cell, place, through, tilt, {held[0] == count, held[1] == count, held[2] == count});
}

void Holds::set(int level, VoxelId cell, const std::array<int, 3>& place, const Through& through,
                const std::array<float, 3>& tilt, const std::array<bool, 3>& immovable) noexcept {
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
  const bool was = this->tilt(level, cell) != std::array<float, 3>{}, is = tilt != std::array<float, 3>{};
  if (is != was) l.row_tilted[cell / kRow] += is ? 1 : -1;
  for (std::size_t p = 0; p < 3 && (is || was); ++p) l.tilt[p][cell] = tilt[p];
}

void Holds::populate() noexcept {
  held_mark_.populate();
  supported_.populate();
  for (Level& l : levels_) {
    l.queued.populate();
    for (auto& pair : l.tilt) pair.populate();
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
    bytes += l.row_held.resident_bytes() + l.row_tilted.resident_bytes() + l.queued.resident_bytes();
    for (const auto& pair : l.tilt) bytes += pair.resident_bytes();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (const auto& d : l.through[axis]) bytes += d.resident_bytes();
      bytes += l.hold[axis].resident_bytes() + l.nearer[axis].resident_bytes();
    }
  }
  return bytes;
}

}  // namespace voxel
