// SPDX-License-Identifier: GPL-3.0-or-later
// Boundary springs of a coarse cell from those of the finer level.
#include "voxel/multigrid/boundary_springs.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>

namespace voxel {

namespace {

// Visits a cell's children (cells or voxels) that lie in the grid.
template <class Visit>
void for_children(const Grid& finer, const std::array<int, 3>& cell, const Visit& visit) {
  for (int corner = 0; corner < 8; ++corner) {
    const std::array<int, 3> child{2 * cell[0] + (corner & 1), 2 * cell[1] + (corner >> 1 & 1),
                                   2 * cell[2] + (corner >> 2)};
    if (child[0] < finer.dims[0] && child[1] < finer.dims[1] && child[2] < finer.dims[2])
      visit(finer.at(child[0], child[1], child[2]), child);
  }
}

constexpr float kImmovable = 1e4F;  // `hold` of a cell that is fixed altogether
// Stiffness of a cell whose voxels all slide (unit: the voxels' own springs).
constexpr float kAllSlide = 16.0F;
// Link of a child to its sibling in the same cell along d.
Spring to_sibling(const VoxelSprings& springs, const std::array<int, 3>& child, std::size_t d) {
  return (child[d] & 1) != 0 ? springs.down[d] : springs.up[d];
}
bool stands(const VoxelSprings& springs) {
  return springs.inverse == std::array<float, 3>{};
}

}  // namespace

namespace {

// Pairs of axes in the order of tilt().
constexpr std::array<std::array<std::size_t, 2>, 3> kPairs{{{0, 1}, {0, 2}, {1, 2}}};

glm::vec3 normal_of(const BoundarySprings::Support& by) {
  constexpr float unit = 1.0F / BoundarySprings::kUnit;
  return glm::vec3(by.n[0], by.n[1], by.n[2]) * unit;
}

// Stiffness along n of springs k (N/m, one per axis) if their end moves freely across n: 1 / (nᵀ k⁻¹ n), the
// Schur complement of the free motion. It is used for contacts with the tool. Beside obstacles √k n nᵀ √k is
// used instead.
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

// Shares of a link's springs that resist the motion of a voxel, by axis and by pair of axes. The voxel has
// support `own`, the other end of the link has support `other`.
struct Kept {
  std::array<float, 3> axes, pairs;
};
Kept kept_by(const BoundarySprings::Support& own, const BoundarySprings::Support& other) {
  using By = BoundarySprings::Support::By;
  Kept kept{};
  if (other.by == By::all) {  // the other end resists all motion that the voxel can make
    kept.axes = {1.0F, 1.0F, 1.0F};
    if (!own.slides()) return kept;
    const glm::vec3 n = normal_of(own);
    for (int axis = 0; axis < 3; ++axis)
      kept.axes[static_cast<std::size_t>(axis)] = std::max(0.0F, 1.0F - n[axis] * n[axis]);
    for (std::size_t p = 0; p < 3; ++p)
      kept.pairs[p] = -n[static_cast<int>(kPairs[p][0])] * n[static_cast<int>(kPairs[p][1])];
    return kept;
  }
  // Direction in which the other end is fixed, as far as this voxel can move that way.
  glm::vec3 n = normal_of(other);
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
  // Springs of the finer level are stored from now on: a moving tool asks for them repeatedly.
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

// Finds the springs of a cell on level 1 from the links between its free voxels and fixed ones. If both ends
// of a link are in the cell, the fixed end is half a link from the cell's middle.
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
  // If all voxels slide, no link resists motion along their normals.
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
    if (!finer.couplings->has_voxel(c)) return;
    ++count;
    const VoxelSprings springs = finer.couplings->find_springs(w);
    // a fixed child needs no springs
    const Found child = stands(springs)       ? Found{}
                        : waits(level - 1, w) ? waiting(level - 1, w)
                                              : known(level - 1, w);
    std::array<float, 3> passed{};  // part of the child's springs that this cell gets
    for (std::size_t axis = 0; axis < 3; ++axis) {
      float before = 0.0F, after = 0.0F;
      const bool stays = springs.inverse[axis] == 0.0F || child.hold[axis] == kImmovable;
      held[axis] += stays ? 1 : 0;
      for (std::size_t d = 0; d < 3; ++d) {
        const float k = to_sibling(springs, c, d).on(static_cast<int>(axis), static_cast<int>(d));
        const float own = child.through[axis][d];
        if (stays) {  // the fixed place begins half a voxel from the middle of this cell
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

}  // namespace voxel
