// SPDX-License-Identifier: GPL-3.0-or-later
// Queries to a CompositeGrid between cycles: displacements, force, energy, memory.
#include <algorithm>
#include <cmath>

#include "voxel/composite/grid.h"
#include "voxel/composite/row_kernels.h"

namespace voxel {
namespace {

using composite::index;

}  // namespace

// Share of a node's cell, along d, that lies within its level's patch: one half on an open side, else 1.
double CompositeGrid::inside_share(const Level& level, std::size_t d, int i) noexcept {
  const AxisNodes& nodes = level.nodes[d];
  return (i < nodes.first && nodes.open_low) || (i > nodes.last && nodes.open_high) ? 0.5 : 1.0;
}

// Share of a node's cell, along d, that lies within the next finer level's patch.
double CompositeGrid::covered_share(std::size_t l, std::size_t d, int i) const noexcept {
  if (l == 0) return 0.0;
  const AxisNodes& fine = levels_[l - 1].nodes[d];
  const int here = fine.fine[index(i)];
  if (here == kOutside) return 0.0;
  return (here < fine.first && fine.open_low) || (here > fine.last && fine.open_high) ? 0.5 : 1.0;
}

// Do a node's anchors count on this level? They do not if the node lies strictly within the finer patch. Nor
// do they on an open side of this patch: there the next coarser level counts them. `number`: of the node,
// from first_row() on.
bool CompositeGrid::counts_anchors(std::size_t l, std::size_t number) const noexcept {
  const Level& level = levels_[l];
  const Index3 node = level.node_of(number);
  bool inside = true, covered = true;
  for (std::size_t d = 0; d < 3; ++d) {
    inside = inside && inside_share(level, d, node[d]) == 1.0;
    covered = covered && covered_share(l, d, node[d]) == 1.0;
  }
  return inside && !covered;
}

// Share of the link from a node to the next one along d that counts on this level: inside this patch and
// outside the finer patch.
double CompositeGrid::link_share(std::size_t l, std::size_t number, std::size_t d) const noexcept {
  const Level& level = levels_[l];
  const Index3 node = level.node_of(number);
  const std::size_t e = (d + 1) % 3, f = (d + 2) % 3;
  const bool inside = covered_share(l, d, node[d]) > 0.0 && covered_share(l, d, node[d] + 1) > 0.0;
  const double under = inside ? covered_share(l, e, node[e]) * covered_share(l, f, node[f]) : 0.0;
  return inside_share(level, e, node[e]) * inside_share(level, f, node[f]) * (1.0 - under);
}

double CompositeGrid::worst_violation() const noexcept {
  const Level& level = levels_[0];
  const auto& nodes = level.nodes;
  double most = 0.0;
  for (int k = nodes[2].first; k <= nodes[2].last; ++k) {
    for (int j = nodes[1].first; j <= nodes[1].last; ++j) {
      for (int i = nodes[0].first; i <= nodes[0].last; ++i) {
        const std::size_t n = level.node(i, j, k);
        for (std::size_t d = 0; d < 3; ++d) {
          if (level.weight[d][n] == 0.0F) continue;
          const std::size_t by = level.stride_along(d);
          for (std::size_t a = 0; a < 3; ++a) {
            const float longer = level.u[a][n + by] - level.u[a][n];
            const auto limit = [&](std::size_t side) {
              return composite::limit_at(limit_of_links(level, a, d, side), n - level.first_row(), by);
            };
            most = std::max(most, static_cast<double>(std::max(longer - limit(1), -longer - limit(0))));
          }
        }
      }
    }
  }
  return most;
}

double CompositeGrid::energy_J() const noexcept {
  double energy = brick_energy_J();
  for (std::size_t l = 0; l <= covering_level_; ++l) {
    const Level& level = levels_[l];
    const std::size_t first = level.first_row(), end = first + level.floats();
    for (std::size_t d = 0; d < 3; ++d) {
      const std::size_t by = d == 0 ? 1 : d == 1 ? level.stride : level.plane;
      const float *const weight = level.weight[d].data(), *const anchor_weight =
                                                              level.anchor_weight[d].data();
      for (std::size_t n = first; n < end; ++n) {
        if (weight[n] == 0.0F && anchor_weight[n] == 0.0F) continue;
        double of_link = 0.0, of_anchor = 0.0;
        for (std::size_t a = 0; a < 3; ++a) {
          const float* u = level.u[a].data() + n;
          const double k = 0.5 * static_cast<double>(spring_N_per_m_[d][a]),
                       longer = static_cast<double>(u[by] - *u);
          of_link += k * static_cast<double>(weight[n]) * longer * longer;
          of_anchor += k * static_cast<double>(anchor_weight[n] * *u * *u);
        }
        if (of_link != 0.0) energy += of_link * link_share(l, n - first, d);
        if (of_anchor != 0.0 && counts_anchors(l, n - first)) energy += of_anchor;
      }
    }
  }
  return energy;
}

// Trilinear interpolation at `place` (coordinates). Outside the level it gives the value at the nearest place
// on its edge.
glm::dvec3 CompositeGrid::interpolate(const Level& level, const std::array<double, 3>& place) const noexcept {
  std::array<int, 3> node{};
  std::array<float, 3> part{};
  for (std::size_t d = 0; d < 3; ++d) {
    const AxisNodes& nodes = level.nodes[d];
    const double steps = (place[d] - nodes.begin) / level.step;
    node[d] = std::clamp(static_cast<int>(steps), 0, std::max(0, nodes.count - 2));
    part[d] = static_cast<float>(std::clamp(steps - node[d], 0.0, nodes.count > 1 ? 1.0 : 0.0));
  }
  const std::size_t first = level.node(node[0], node[1], node[2]);
  std::array<float, 3> sum{};
  for (int corner = 0; corner < 8; ++corner) {
    const int i = corner & 1, j = (corner >> 1) & 1, k = corner >> 2;
    const float w = (i != 0 ? part[0] : 1.0F - part[0]) * (j != 0 ? part[1] : 1.0F - part[1]) *
                    (k != 0 ? part[2] : 1.0F - part[2]);
    if (w == 0.0F) continue;
    const std::size_t at = first + index(i) + index(j) * level.stride + index(k) * level.plane;
    for (std::size_t a = 0; a < 3; ++a) sum[a] += w * level.u[a][at];
  }
  return {sum[0], sum[1], sum[2]};
}

// interpolate() at a voxel (coordinates).
glm::vec3 CompositeGrid::interpolate_at(const Level& level, const Index3& at) noexcept {
  std::array<std::size_t, 3> by{};
  std::array<float, 3> part{};
  Index3 node{};
  for (std::size_t d = 0; d < 3; ++d) {
    const AxisNodes& nodes = level.nodes[d];
    const int way = std::clamp(at[d] - nodes.begin, 0, level.step * (nodes.count - 1));
    node[d] = way >> level.log2_step;
    part[d] = static_cast<float>(way & (level.step - 1)) / static_cast<float>(level.step);
    by[d] = part[d] > 0.0F ? level.stride_along(d) : 0;
  }
  const std::size_t n = level.node(node[0], node[1], node[2]);
  glm::vec3 result;
  for (std::size_t a = 0; a < 3; ++a) {
    const float* const u = level.u[a].data() + n;
    const auto along_x = [&](std::size_t from) { return u[from] + part[0] * (u[from + by[0]] - u[from]); };
    const auto along_y = [&](std::size_t from) {
      const float low = along_x(from);
      return low + part[1] * (along_x(from + by[1]) - low);
    };
    const float low = along_y(0);
    result[static_cast<int>(a)] = low + part[2] * (along_y(by[2]) - low);
  }
  return result;
}

glm::dvec3 CompositeGrid::at_point(const std::array<double, 3>& point) const noexcept {
  const std::array<double, 3> place{point[0] + material_.offset()[0], point[1] + material_.offset()[1],
                                    point[2] + material_.offset()[2]};
  for (std::size_t l = 0; l < covering_level_; ++l) {
    const Level& level = levels_[l];
    bool inside = true;
    for (std::size_t d = 0; d < 3; ++d) {
      const AxisNodes& nodes = level.nodes[d];
      inside = inside && (!nodes.open_low || place[d] >= nodes.begin) &&
               (!nodes.open_high || place[d] <= level.at(d, nodes.count - 1));
    }
    if (inside) return interpolate(level, place);
  }
  return interpolate(levels_[covering_level_], place);
}

glm::dvec3 CompositeGrid::at(const Index3& voxel) const noexcept {
  return at_point(
      {static_cast<double>(voxel[0]), static_cast<double>(voxel[1]), static_cast<double>(voxel[2])});
}

CompositeGrid::Nodes CompositeGrid::nodes_of(std::size_t box) const noexcept {
  const Level& level = levels_[box];
  Nodes result;
  result.step = level.step;
  result.stride = level.stride;
  result.plane = level.plane;
  for (std::size_t d = 0; d < 3; ++d) {
    result.first[d] = level.nodes[d].begin - material_.offset()[d];
    result.count[d] = level.nodes[d].count;
    result.open_low[d] = level.nodes[d].open_low;
    result.open_high[d] = level.nodes[d].open_high;
    result.u[d] = level.u[d].data() + level.first_row();
  }
  return result;
}

std::size_t CompositeGrid::memory_bytes() const {
  std::size_t bytes = levels_.capacity() * sizeof(Level) + pressed_.capacity() * sizeof(Pressed) +
                      material_.memory_bytes() + beside_rigid_.capacity() * sizeof(BesideRigid) +
                      is_beside_rigid_.capacity() + obstacle_loads_.capacity() * sizeof(ObstacleLoad) +
                      obstacle_bounds_.capacity() * sizeof(ObstacleBound) +
                      supporting_bounds_.capacity() * sizeof(std::uint32_t) +
                      chains_.capacity() * sizeof(ChainExtension) + is_tissue_node_.capacity() +
                      faces_of_cell_.capacity() * sizeof(float);
  for (const auto& sides : anchor_faces_) {
    for (const AnchorFaces& faces : sides) bytes += 5 * faces.count.capacity() * sizeof(float);
  }
  const auto add = [&bytes](const Level& level) {
    for (const auto* arrays : {&level.u, &level.at_bound, &level.weight, &level.anchor_weight,
                               &level.shape_weight, &level.inverse_diagonal, &level.diagonal}) {
      for (const Floats& array : *arrays) bytes += array.capacity() * sizeof(float);
    }
    for (const Floats* array :
         {&level.f, &level.restricted_u, &level.residual, &level.is_free, &level.is_active,
          &level.active_stiffness, &level.inverse_with_active, &level.bound[0], &level.bound[1]})
      bytes += array->capacity() * sizeof(float);
    bytes += level.ghosts.capacity() * sizeof(Ghost) +
             level.ghost_neighbours.capacity() * sizeof(GhostNeighbour) +
             level.correction_springs.capacity() * sizeof(CorrectionSpring) +
             level.obstacle_nodes.capacity() * sizeof(ObstacleNode) +
             level.obstacle_of.capacity() * sizeof(std::uint32_t);
  };
  const auto add_limits = [&bytes](const Level& level) {
    for (const auto* arrays : {&level.anchor_distance, &level.limited_weight[0], &level.limited_weight[1],
                               &level.limited_weight[2], &level.limited_anchor_weight[0],
                               &level.limited_anchor_weight[1], &level.limited_anchor_weight[2]}) {
      for (const Floats& array : *arrays) bytes += array.capacity() * sizeof(float);
    }
  };
  for (const Level& level : levels_) {
    add(level);
    add_limits(level);
  }
  add(before_move_);
  add_limits(before_move_);
  const auto add_floats = [&bytes](const Floats& array) { bytes += array.capacity() * sizeof(float); };
  for (const Level& level : levels_) {
    add_floats(level.brick_modulus);
    for (const Floats& load : level.brick_load) add_floats(load);
    for (const Floats& strain : level.brick_strain) add_floats(strain);
  }
  for (const Floats& strain : before_move_.brick_strain) add_floats(strain);
  for (const Floats& force : bricks_.forces) add_floats(force);
  for (const HalfCells& plane : half_cells_) {
    for (const Floats* part : {&plane.cells, &plane.stiffness[0], &plane.stiffness[1], &plane.stiffness[2]})
      bytes += part->capacity() * sizeof(float);
  }
  return bytes;
}

void CompositeGrid::interpolate_from(const CompositeGrid& other) noexcept {
  for (Level& level : levels_) {
    const auto& nodes = level.nodes;
    for (int k = 0; k < nodes[2].count; ++k) {
      for (int j = 0; j < nodes[1].count; ++j) {
        for (int i = 0; i < nodes[0].count; ++i) {
          const std::size_t n = level.node(i, j, k);
          const auto& offset = material_.offset();
          const glm::dvec3 u =
              other.at({level.at(0, i) - offset[0], level.at(1, j) - offset[1], level.at(2, k) - offset[2]});
          for (std::size_t a = 0; a < 3; ++a)
            level.u[a][n] = level.inverse_diagonal[a][n] != 0.0F || nodes[a].open_low || nodes[a].open_high
                                ? static_cast<float>(u[static_cast<int>(a)])
                                : 0.0F;
        }
      }
    }
  }
}

}  // namespace voxel
