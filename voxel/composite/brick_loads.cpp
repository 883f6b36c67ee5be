// SPDX-License-Identifier: GPL-3.0-or-later
// The accurate energy on nested patches: bricks as a deferred correction of the links (Stetter 1978; see
// fem/deferred_correction.h). On each level a node has a load, the force of its bricks minus the force of the
// links of their cells. Cycles solve for the links, with the loads fixed. Loads are found anew before each
// cycle.
//
// The cells beside a link share its stiffness. A cell of a coarse level is a brick as stiff as the least
// share that it has of one of its links. The other links may be stiffer, for example where a stiff layer
// crosses the cell. Their excess stiffness stays in the links alone. So links and loads together are never
// less stiff than bricks of the softest tissue, and cycles converge.
#include <algorithm>
#include <array>
#include <limits>

#include "voxel/composite/brick_forces.h"
#include "voxel/composite/grid.h"

namespace voxel {
namespace {

using composite::GridLevel;
using composite::index;
using composite::Index3;

template <class Visit>
void for_cells(const GridLevel& level, const Visit& visit) {
  for (int k = 0; k + 1 < level.nodes[2].count; ++k) {
    for (int j = 0; j + 1 < level.nodes[1].count; ++j) {
      for (int i = 0; i + 1 < level.nodes[0].count; ++i) visit(Index3{i, j, k}, level.node(i, j, k));
    }
  }
}

// Can a node without a link along d bear loads along d? An anchored node can. So can a node that is no
// unknown, because it moves with others.
bool holds_load(const GridLevel& level, std::size_t d, std::size_t n) noexcept {
  return level.anchor_weight[d][n] > 0.0F || level.inverse_diagonal[d][n] == 0.0F;
}

// The least share that a cell has of the stiffness of one of its twelve links, relative to a full link of the
// level. Links that anchors replace do not count, if both ends can bear loads without them. `shared`: all
// cells beside a link share it, including cells beyond an open side of the patch.
float least_share(const GridLevel& level, const Index3& cell, bool shared) noexcept {
  const float whole = 1.0F / static_cast<float>(level.step);
  float least = std::numeric_limits<float>::max();
  for (std::size_t d = 0; d < 3; ++d) {
    const std::size_t e = (d + 1) % 3, f = (d + 2) % 3;
    for (int edge = 0; edge < 4; ++edge) {
      Index3 at = cell;
      at[e] += edge & 1;
      at[f] += edge >> 1;
      const std::size_t n = level.node(at[0], at[1], at[2]);
      const float weight = level.weight[d][n];
      if (weight == 0.0F) {
        const std::size_t end = n + level.stride_along(d);
        const bool anchored = level.anchor_weight[d][n] > 0.0F || level.anchor_weight[d][end] > 0.0F;
        if (anchored && holds_load(level, d, n) && holds_load(level, d, end)) continue;
        return 0.0F;
      }
      int cells = 0;
      for (int side = 0; shared && side < 4; ++side) {
        Index3 beside = at;
        beside[e] -= side & 1;
        beside[f] -= side >> 1;
        const auto beyond = [&](std::size_t g) {
          return (beside[g] < 0 && level.nodes[g].open_low) ||
                 (beside[g] + 1 >= level.nodes[g].count && level.nodes[g].open_high);
        };
        const auto inside = [&](std::size_t g) {
          return beside[g] >= 0 && beside[g] + 1 < level.nodes[g].count;
        };
        if (inside(e) && inside(f)) {
          cells += level.brick_modulus[level.node(beside[0], beside[1], beside[2])] > 0.0F ? 1 : 0;
        } else {
          cells += (inside(e) || beyond(e)) && (inside(f) || beyond(f)) ? 1 : 0;
        }
      }
      least = std::min(least, whole * weight * 4.0F / static_cast<float>(std::max(cells, 1)));
    }
  }
  return least == std::numeric_limits<float>::max() ? 0.0F : least;
}

// Nodes on the open sides of a patch are interpolated from the coarse level, and their loads act on coarse
// nodes. The share of a coarse node is in proportion to its interpolation weight and to its stiffness. By the
// weight alone, a node that barely touches the tissue would move without bound under the load of stiff
// bricks. Nodes without stiffness (ghosts and anchors) count as the stiffest of the others.
void add_loads_of_sides(const GridLevel& fine, GridLevel& coarse, std::size_t a) noexcept {
  const auto& nodes = fine.nodes;
  const auto on_side = [&](std::size_t d, int i) { return i < nodes[d].first || i > nodes[d].last; };
  for (int k = 0; k < nodes[2].count; ++k) {
    for (int j = 0; j < nodes[1].count; ++j) {
      const bool side = on_side(2, k) || on_side(1, j);
      for (int i = 0; i < nodes[0].count; i += side || i + 1 >= nodes[0].count ? 1 : nodes[0].count - 1) {
        const float load = fine.brick_load[a][fine.node(i, j, k)];
        if (load == 0.0F || (!side && !on_side(0, i))) continue;
        const Index3 at{i, j, k};
        std::array<std::size_t, 8> to{};
        std::array<float, 8> share{}, stiffness{};
        float stiffest = 0.0F, sum = 0.0F;
        for (int corner = 0; corner < 8; ++corner) {
          const std::size_t c = index(corner);
          Index3 node{};
          share[c] = 1.0F;
          for (std::size_t d = 0; d < 3; ++d) {
            const float after = nodes[d].weight_after[index(at[d])];
            const int up = corner >> d & 1;
            node[d] = nodes[d].coarse[index(at[d])] + up;
            share[c] *= up != 0 ? after : 1.0F - after;
          }
          if (share[c] == 0.0F) continue;
          to[c] = coarse.node(node[0], node[1], node[2]);
          for (const auto& diagonal : coarse.diagonal) stiffness[c] += diagonal[to[c]];
          stiffest = std::max(stiffest, stiffness[c]);
        }
        for (std::size_t c = 0; c < 8; ++c) {
          share[c] *= stiffness[c] > 0.0F ? stiffness[c] : stiffest > 0.0F ? stiffest : 1.0F;
          sum += share[c];
        }
        for (std::size_t c = 0; c < 8; ++c) {
          if (share[c] != 0.0F) coarse.brick_load[a][to[c]] += load * share[c] / sum;
        }
      }
    }
  }
}

}  // namespace

void CompositeGrid::use_bricks() {
  if (!lattice_.has_bricks()) return;
  const LinkMaterial& m =
      lattice_.materials()[lattice_.material_of(lattice_.label(lattice_.surface().front()))];
  const BrickStiffness brick = brick_stiffness(m.young_Pa, m.poisson, lattice_.spacing_m());
  const BrickStiffness links = link_cell_stiffness(m.young_Pa, m.poisson, lattice_.spacing_m());
  bricks_.deferred = composite::deferred_brick(brick, links);
  bricks_.less_links = composite::brick_blocks(difference(brick, links));
  has_bricks_ = true;
}

// Stiffness of the cell above each node on all axes, relative to the reference; 0 where there is no cell.
void CompositeGrid::find_brick_moduli(Level& level) noexcept {
  const auto& nodes = level.nodes;
  std::fill(level.brick_modulus.begin(), level.brick_modulus.end(), 0.0F);
  if (level.step == 1) {
    const int nx = nodes[0].count - 1, ny = nodes[1].count - 1;
    Floats& plane = half_cells_[0].cells;
    plane.resize(std::max(plane.size(), index(std::max(nx * ny, 0))));
    for (int k = 0; k + 1 < nodes[2].count; ++k) {
      material_.cell_stiffness(nodes[2].begin + k, nodes[0].begin, nx, nodes[1].begin, ny, plane.data());
      for (int j = 0; j < ny; ++j)
        std::copy_n(plane.data() + index(j * nx), nx, level.brick_modulus.data() + level.row(j, k));
    }
    return;
  }
  // A cell exists if all of its links do.
  for_cells(level, [&](const Index3& cell, std::size_t n) {
    level.brick_modulus[n] = least_share(level, cell, false) > 0.0F ? 1.0F : 0.0F;
  });
  for_cells(level, [&](const Index3& cell, std::size_t n) {
    if (level.brick_modulus[n] > 0.0F) level.brick_modulus[n] = least_share(level, cell, true);
  });
}

// The view leaves out the forces of cells that the finer patch covers.
composite::BrickView CompositeGrid::brick_view(std::size_t l) const noexcept {
  const Level& level = levels_[l];
  composite::BrickView v{};
  const std::size_t from = level.first_row();
  for (std::size_t a = 0; a < 3; ++a) {
    v.u[a] = level.u[a].data() + from;
    v.cells[a] = level.nodes[a].count - 1;
    v.covered_first[a] = v.cells[a];
    v.covered_last[a] = -1;
    for (int i = 0; i < v.cells[a]; ++i) {
      if (covered_share(l, a, i) == 0.0 || covered_share(l, a, i + 1) == 0.0) continue;
      v.covered_first[a] = std::min(v.covered_first[a], i);
      v.covered_last[a] = i;
    }
  }
  v.modulus = level.brick_modulus.data() + from;
  v.scale = static_cast<float>(level.step);
  v.stride = level.stride;
  v.plane = level.plane;
  return v;
}

// Finds the loads of all nodes, from strains that follow those of the present displacements.
void CompositeGrid::renew_brick_loads() noexcept {
  if (!has_bricks_) return;
  for (std::size_t l = 0; l <= covering_level_; ++l) {
    Level& level = levels_[l];
    const std::size_t from = level.first_row();
    composite::BrickView v = brick_view(l);
    std::array<float*, composite::DeferredBrick::kStrains> strains{};
    for (std::size_t s = 0; s < strains.size(); ++s) strains[s] = level.brick_strain[s].data() + from;
    for (std::size_t a = 0; a < 3; ++a) {
      v.force[a] = level.brick_load[a].data() + from;
      std::fill_n(v.force[a], level.floats(), 0.0F);
    }
    composite::add_deferred_forces(v, bricks_.deferred, strains);
    for (std::size_t a = 0; a < 3; ++a) {
      if (l > 0) add_loads_of_sides(levels_[l - 1], level, a);
      distribute_ghost_loads(level, level.brick_load[a].data());
    }
  }
}

void CompositeGrid::save_brick_strains(const Level& level, std::size_t floats) noexcept {
  if (!has_bricks_) return;
  for (std::size_t s = 0; s < level.brick_strain.size(); ++s)
    std::copy_n(level.brick_strain[s].begin(), floats, before_move_.brick_strain[s].begin());
}

// Takes the strains that were saved before level l moved `by` nodes. Cells that are new in the patch take the
// strain of the next coarser level. The strain of interpolated displacements would be far from equilibrium,
// because interpolation changes the volume of cells.
void CompositeGrid::restore_brick_strains(std::size_t l, const Index3& by) noexcept {
  if (!has_bricks_) return;
  Level& level = levels_[l];
  const Level& coarse = levels_[l + 1];
  for (int k = 0; k + 1 < level.nodes[2].count; ++k) {
    for (int j = 0; j + 1 < level.nodes[1].count; ++j) {
      for (int i = 0; i + 1 < level.nodes[0].count; ++i) {
        const Index3 cell{i, j, k};
        Index3 was{}, over{};
        bool known = true;
        for (std::size_t d = 0; d < 3; ++d) {
          was[d] = cell[d] + by[d];
          known = known && was[d] >= 0 && was[d] + 1 < before_move_.nodes[d].count;
          over[d] = std::clamp((level.at(d, cell[d]) - coarse.nodes[d].begin) >> coarse.log2_step, 0,
                               std::max(coarse.nodes[d].count - 2, 0));
        }
        const std::size_t to = level.node(i, j, k), above = coarse.node(over[0], over[1], over[2]);
        for (std::size_t s = 0; s < level.brick_strain.size(); ++s) {
          level.brick_strain[s][to] =
              known ? before_move_.brick_strain[s][before_move_.node(was[0], was[1], was[2])]
              : coarse.brick_modulus[above] > 0.0F ? 0.5F * coarse.brick_strain[s][above]
                                                   : composite::kNewStrain;
        }
      }
    }
  }
}

// Energy of the bricks beyond that of the links of their cells (J). Each cell counts on its finest level.
double CompositeGrid::brick_energy_J() const noexcept {
  double energy = 0.0;
  for (std::size_t l = 0; has_bricks_ && l <= covering_level_; ++l) {
    const Level& level = levels_[l];
    const std::size_t first = level.first_row(), end = first + level.floats();
    composite::BrickView v = brick_view(l);
    for (std::size_t a = 0; a < 3; ++a) {
      std::fill_n(bricks_.forces[a].begin(), end + kPad, 0.0F);
      v.force[a] = bricks_.forces[a].data() + first;
    }
    composite::add_brick_forces(v, bricks_.less_links);
    for (std::size_t a = 0; a < 3; ++a) {
      for (std::size_t n = first; n < end; ++n)
        energy -= 0.5 * static_cast<double>(level.u[a][n]) * static_cast<double>(bricks_.forces[a][n]);
    }
  }
  return energy;
}

}  // namespace voxel
