// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/multigrid/boundary_springs.h"

#include <algorithm>
#include <bit>
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

bool stands(const VoxelSprings& springs) {
  return springs.inverse == std::array<float, 3>{};
}

// Lanes of a row of the next coarser level, of its first half.
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

// Rows with a cell that anchors may hold, on each level.
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

// Lanes of voxels that are anchored or linked to one that is.
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

// Lanes of the cells of a row that hold such a voxel.
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

// Of a cell that waits.
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

// What holds voxel v changed, and with that its cell and those of its neighbours.
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

namespace {

// Pairs of axes, as tilt() has them.
constexpr std::array<std::array<std::size_t, 2>, 3> kPairs{{{0, 1}, {0, 2}, {1, 2}}};

glm::vec3 normal_of(const BoundarySprings::Support& by) {
  constexpr float unit = 1.0F / BoundarySprings::kUnit;
  return glm::vec3(by.n[0], by.n[1], by.n[2]) * unit;
}

// What is left of springs k (N/m) whose other end goes freely across n: one along n, n nᵀ / (nᵀ k⁻¹ n), the
// Schur complement of where that end goes. (With √k n nᵀ √k, as beside obstacles, other ways are free than
// those along the tool where tissue is stiffer along links than across them, and a cycle left 0.74 of what a
// pressed ball's voxels had still to slide, now 0.35 to 0.5. Beside obstacles this did no good: a body on
// tight links, which came to rest to 0.1 mm/s, went on at 0.1 to 0.2.)
float spring_along(const glm::vec3& n, const std::array<float, 3>& k) {
  float compliance = 0.0F;
  for (int axis = 0; axis < 3; ++axis) {
    const float of_axis = k[static_cast<std::size_t>(axis)];
    if (n[axis] == 0.0F) continue;
    if (of_axis <= 0.0F) return 0.0F;
    compliance += n[axis] * n[axis] / of_axis;
  }
  return compliance > 0.0F ? 1.0F / compliance : 0.0F;
}

// Of a voxel that is held as `own` is, what a link to one held as `other` keeps from moving: of each axis,
// and of pairs, in parts of the link's springs.
struct Kept {
  std::array<float, 3> axes, pairs;
};
Kept kept_by(const BoundarySprings::Support& own, const BoundarySprings::Support& other) {
  using By = BoundarySprings::Support::By;
  Kept kept{};
  if (other.by == By::all) {  // all that the voxel can do
    kept.axes = {1.0F, 1.0F, 1.0F};
    if (!own.slides()) return kept;
    const glm::vec3 n = normal_of(own);
    for (int axis = 0; axis < 3; ++axis)
      kept.axes[static_cast<std::size_t>(axis)] = std::max(0.0F, 1.0F - n[axis] * n[axis]);
    for (std::size_t p = 0; p < 3; ++p)
      kept.pairs[p] = -n[static_cast<int>(kPairs[p][0])] * n[static_cast<int>(kPairs[p][1])];
    return kept;
  }
  glm::vec3 n = normal_of(other);  // along which the other one stays, as far as this one can go that way
  if (own.slides()) {
    const glm::vec3 stays = normal_of(own);
    n -= (n.x * stays.x + n.y * stays.y + n.z * stays.z) * stays;
  }
  for (int axis = 0; axis < 3; ++axis) kept.axes[static_cast<std::size_t>(axis)] = n[axis] * n[axis];
  for (std::size_t p = 0; p < 3; ++p)
    kept.pairs[p] = n[static_cast<int>(kPairs[p][0])] * n[static_cast<int>(kPairs[p][1])];
  return kept;
}

}  // namespace

void BoundarySprings::renew(int level, VoxelId cell) noexcept {
  // What is below it is kept from now on: a tool that moves asks for it again and again.
  if (level > 1) {
    const Level& finer = at(level - 1);
    for_children(finer.couplings->grid(), at(level).couplings->grid().coordinates(cell),
                 [&](VoxelId w, const std::array<int, 3>&) {
                   if (!waits(level - 1, w) || stands(finer.couplings->find_springs(w))) return;
                   if (level - 1 >= LevelStiffness::kKept) {
                     set(level - 1, w, waiting(level - 1, w));
                   } else {
                     renew(level - 1, w);
                   }
                 });
  }
  set(level, cell, find(level, cell));
}

BoundarySprings::Found BoundarySprings::find(int level, VoxelId cell) const noexcept {
  Found found;
  Axes all{};
  level == 1 ? find_first(cell, found, all) : find_above(level, cell, found, all);
  complete(level, cell, all, found);
  return found;
}

void BoundarySprings::complete(int level, VoxelId cell, const Axes& all, Found& found) const noexcept {
  const LevelStiffness& couplings = *at(level).couplings;
  const std::array<int, 3> place = couplings.grid().coordinates(cell);
  const VoxelSprings own = couplings.find_springs(cell);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    float sum = 0.0F;
    for (std::size_t d = 0; d < 3; ++d) {
      sum += found.through[axis][d];
      const float k = to_sibling(own, place, d).on(static_cast<int>(axis), static_cast<int>(d));
      if (k > 0.0F) found.nearer[axis] += found.through[axis][d] / (2.0F * k);
    }
    found.hold[axis] = all[axis] ? kImmovable : std::min(sum * own.inverse[axis], kImmovable);
  }
}

BoundarySprings::Found BoundarySprings::known(int level, VoxelId cell) const noexcept {
  const Level& l = at(level);
  const RowId row = cell / kRow;
  Found out;
  if ((l.row_held[row] & ~kWaits) == 0 && l.row_tilted[row] == 0) return out;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t d = 0; d < 3; ++d) out.through[axis][d] = l.through[axis][d][cell];
    out.hold[axis] = l.hold[axis][cell];
    out.tilt[axis] = l.tilt[axis][cell];
  }
  return out;
}

// Voxels of a cell that are free, by their links to others that are not: in the same cell, these are half a
// link from its middle.
void BoundarySprings::find_first(VoxelId cell, Found& found, Axes& all) const noexcept {
  const Grid& g = lattice_.grid();
  const LevelStiffness& couplings = *at(0).couplings;
  const std::array<int, 3> place = at(1).couplings->grid().coordinates(cell);
  Through& through = found.through;
  std::array<float, 3>& tilt = found.tilt;
  std::array<float, 3> all_along{}, all_across{};
  std::array<int, 3> held{};
  int count = 0, supported = 0;
  for_children(g, place, [&](VoxelId v, const std::array<int, 3>& c) {
    if (!lattice_.filled(v)) return;
    ++count;
    const Support own = support_of(v);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const bool stays = own.by == Support::By::all || (own.slides() && std::abs(own.n[axis]) == kUnit);
      held[axis] += stays ? 1 : 0;
    }
    supported += own.by == Support::By::nothing ? 0 : 1;
    if (own.by == Support::By::all) return;
    const VoxelSprings springs = couplings.find_springs(v);
    if (own.slides()) {
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
        const bool on_tool = other.by == Support::By::tool;
        const float along = on_tool ? spring_along(normal_of(other), {k(0), k(1), k(2)}) : 0.0F;
        for (std::size_t axis = 0; axis < 3; ++axis)
          through[axis][d] += kept.axes[axis] * (on_tool ? along : k(axis));
        for (std::size_t p = 0; p < 3; ++p) {
          const auto [a, b] = kPairs[p];
          tilt[p] += kept.pairs[p] * (on_tool ? along : std::sqrt(k(a) * k(b)));
        }
      }
    }
  });
  // Of voxels that all slide, no link says that they do not go along their normals.
  if (supported == count) {
    for (std::size_t axis = 0; axis < 3; ++axis) through[axis][axis] += kAllSlide * all_along[axis];
    for (std::size_t p = 0; p < 3; ++p) tilt[p] += kAllSlide * all_across[p];
  }
  for (std::size_t axis = 0; axis < 3; ++axis) all[axis] = held[axis] == count;
}

void BoundarySprings::find_above(int level, VoxelId cell, Found& found, Axes& all) const noexcept {
  const Level& finer = at(level - 1);
  const std::array<int, 3> place = at(level).couplings->grid().coordinates(cell);
  const auto size = static_cast<float>(1 << level);
  Through& through = found.through;
  std::array<float, 3>& tilt = found.tilt;
  std::array<int, 3> held{};
  int count = 0;
  for_children(finer.couplings->grid(), place, [&](VoxelId w, const std::array<int, 3>& c) {
    if (!finer.couplings->holds_any(c)) return;
    ++count;
    const VoxelSprings springs = finer.couplings->find_springs(w);
    // What stands does so whatever holds it.
    const Found child = stands(springs)       ? Found{}
                        : waits(level - 1, w) ? waiting(level - 1, w)
                                              : known(level - 1, w);
    std::array<float, 3> passed{};  // of what holds the child, that part holds this one
    for (std::size_t axis = 0; axis < 3; ++axis) {
      float before = 0.0F, after = 0.0F;
      const bool stays = springs.inverse[axis] == 0.0F || child.hold[axis] == kImmovable;
      held[axis] += stays ? 1 : 0;
      for (std::size_t d = 0; d < 3; ++d) {
        const float k = to_sibling(springs, c, d).on(static_cast<int>(axis), static_cast<int>(d));
        const float own = child.through[axis][d];
        if (stays) {  // up to the middle of this one, but for half a voxel
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
      if (child.tilt[p] != 0.0F)
        tilt[p] += child.tilt[p] * std::sqrt(passed[kPairs[p][0]] * passed[kPairs[p][1]]);
    }
  });
  for (std::size_t axis = 0; axis < 3; ++axis) all[axis] = held[axis] == count;
}

void BoundarySprings::set(int level, VoxelId cell, const Found& found) noexcept {
  Level& l = at(level);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t d = 0; d < 3; ++d) l.through[axis][d][cell] = found.through[axis][d];
    float& hold = l.hold[axis][cell];
    if ((hold != 0.0F) != (found.hold[axis] != 0.0F))
      l.row_held[cell / kRow] += found.hold[axis] != 0.0F ? 1 : -1;
    hold = found.hold[axis];
    l.nearer[axis][cell] = found.nearer[axis];
  }
  const bool was = tilt(level, cell) != std::array<float, 3>{}, is = found.tilt != std::array<float, 3>{};
  if (is != was) l.row_tilted[cell / kRow] += is ? 1 : -1;
  for (std::size_t p = 0; p < 3 && (is || was); ++p) l.tilt[p][cell] = found.tilt[p];
  if ((l.row_held[cell / kRow] & kWaits) != 0) l.found[cell / kRow] |= 1U << cell % kRow;
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
