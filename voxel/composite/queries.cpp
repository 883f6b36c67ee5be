// SPDX-License-Identifier: GPL-3.0-or-later
// What is asked of a composite grid between cycles: places, the force, the energy.
#include <algorithm>
#include <bit>
#include <cmath>

#include "voxel/composite/grid.h"

namespace voxel {
namespace {

std::size_t index(int i) {
  return static_cast<std::size_t>(i);
}

}  // namespace

// What of a node's cell across d lies within its level's box: beyond a side there is half of it.
double CompositeGrid::inside_share(const Level& level, std::size_t d, int i) noexcept {
  const AxisNodes& line = level.line[d];
  return (i < line.first && line.open_low) || (i > line.last && line.open_high) ? 0.5 : 1.0;
}

// … and within the finer level's.
double CompositeGrid::covered_share(std::size_t l, std::size_t d, int i) const noexcept {
  if (l == 0) return 0.0;
  const AxisNodes& fine = levels_[l - 1].line[d];
  const int here = fine.fine[index(i)];
  if (here == kOutside) return 0.0;
  return (here < fine.first && fine.open_low) || (here > fine.last && fine.open_high) ? 0.5 : 1.0;
}

// What anchors hold of a node (its number in its level) in direction d, and not of others.
double CompositeGrid::anchor_share(std::size_t l, std::size_t number, std::size_t d) const noexcept {
  const Level& level = levels_[l];
  const Index3 node = level.node_of(number);
  const std::size_t e = (d + 1) % 3, f = (d + 2) % 3;
  if (inside_share(level, d, node[d]) < 1.0) return 0.0;
  const double under = covered_share(l, d, node[d]) == 1.0 ? covered_share(l, e, node[e]) * covered_share(l, f, node[f]) : 0.0;
  return inside_share(level, e, node[e]) * inside_share(level, f, node[f]) * (1.0 - under);
}

// Likewise of the link up.
double CompositeGrid::link_share(std::size_t l, std::size_t number, std::size_t d) const noexcept {
  const Level& level = levels_[l];
  const Index3 node = level.node_of(number);
  const std::size_t e = (d + 1) % 3, f = (d + 2) % 3;
  const bool inside = covered_share(l, d, node[d]) > 0.0 && covered_share(l, d, node[d] + 1) > 0.0;
  const double under = inside ? covered_share(l, e, node[e]) * covered_share(l, f, node[f]) : 0.0;
  return inside_share(level, e, node[e]) * inside_share(level, f, node[f]) * (1.0 - under);
}

glm::dvec3 CompositeGrid::force_on_tool_N() const noexcept {
  glm::dvec3 carried(0.0);
  for (std::size_t l = 0; l <= covering_level_; ++l) {
    const Level& level = levels_[l];
    if (!level.holds) continue;
    const std::size_t first = level.first_row(), end = first + level.floats();
    for (std::size_t d = 0; d < 3; ++d) {
      const float* const hold = level.hold[d].data();
      const std::array<const float*, 3> held{anchor_weights_on(level, 0)[d].data(), anchor_weights_on(level, 1)[d].data(),
                                             anchor_weights_on(level, 2)[d].data()};
      for (std::size_t n = first; n < end; ++n) {
        if (hold[n] == 0.0F) continue;
        const double part = anchor_share(l, n - first, d);
        for (std::size_t a = 0; a < 3; ++a) {
          carried[static_cast<int>(a)] +=
              part * static_cast<double>(held[a][n] * spring_N_per_m_[d][a] * level.u[a][n]);
        }
      }
    }
  }
  return -carried;
}

double CompositeGrid::anchor_area_ratio() const noexcept {
  double all = 0.0;
  for (RowId row = 0; row < lattice_.grid().rows(); ++row) {
    std::uint32_t lanes = lattice_.anchored_lanes(row);
    for (; lanes != 0; lanes &= lanes - 1) {
      const VoxelId v = row * kRow + static_cast<VoxelId>(std::countr_zero(lanes));
      for (int d = 0; d < 3; ++d) {
        for (const VoxelId w : {lattice_.up(v, d), lattice_.down(v, d)})
          all += lattice_.filled(w) && !lattice_.anchored(w) ? 1.0 : 0.0;
      }
    }
  }
  return all > 0.0 ? levels_[covering_level_].anchored_area / all : 0.0;
}

double CompositeGrid::worst_violation() const noexcept {
  const Level& level = levels_[0];
  const auto& line = level.line;
  double most = 0.0;
  for (int k = line[2].first; k <= line[2].last; ++k) {
    for (int j = line[1].first; j <= line[1].last; ++j) {
      for (int i = line[0].first; i <= line[0].last; ++i) {
        const std::size_t n = level.node(i, j, k);
        for (std::size_t d = 0; d < 3; ++d) {
          if (level.weight[d][n] == 0.0F) continue;
          const std::size_t by = d == 0 ? 1 : d == 1 ? level.stride : level.plane;
          for (std::size_t a = 0; a < 3; ++a) {
            const float longer = level.u[a][n + by] - level.u[a][n];
            most = std::max(most,
                            static_cast<double>(std::max(longer - limit_m_[d][a][1], -longer - limit_m_[d][a][0])));
          }
        }
      }
    }
  }
  return most;
}

double CompositeGrid::energy_J() const noexcept {
  double energy = 0.0;
  for (std::size_t l = 0; l <= covering_level_; ++l) {
    const Level& level = levels_[l];
    const std::size_t first = level.first_row(), end = first + level.floats();
    for (std::size_t d = 0; d < 3; ++d) {
      const std::size_t by = d == 0 ? 1 : d == 1 ? level.stride : level.plane;
      const float *const link = level.weight[d].data(), *const hold = level.hold[d].data();
      for (std::size_t n = first; n < end; ++n) {
        if (link[n] == 0.0F && hold[n] == 0.0F) continue;
        double of_link = 0.0, of_hold = 0.0;
        for (std::size_t a = 0; a < 3; ++a) {
          const float* u = level.u[a].data() + n;
          const double k = 0.5 * static_cast<double>(spring_N_per_m_[d][a]), longer = static_cast<double>(u[by] - *u);
          of_link += k * static_cast<double>(link[n]) * longer * longer;
          of_hold += k * static_cast<double>(hold[n] * *u * *u);
        }
        if (of_link != 0.0) energy += of_link * link_share(l, n - first, d);
        if (of_hold != 0.0) energy += of_hold * anchor_share(l, n - first, d);
      }
    }
  }
  return energy;
}

// At a place of which a node is near.
glm::dvec3 CompositeGrid::interpolate(const Level& level, const std::array<double, 3>& place) const noexcept {
  std::array<int, 3> node{};
  std::array<float, 3> part{};
  for (std::size_t d = 0; d < 3; ++d) {
    const AxisNodes& line = level.line[d];
    const double steps = (place[d] - line.begin) / level.step;
    node[d] = std::clamp(static_cast<int>(steps), 0, std::max(0, line.count - 2));
    part[d] = static_cast<float>(std::clamp(steps - node[d], 0.0, line.count > 1 ? 1.0 : 0.0));
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

glm::dvec3 CompositeGrid::at_point(const std::array<double, 3>& point) const noexcept {
  const std::array<double, 3> place{point[0] + cells_.offset()[0], point[1] + cells_.offset()[1],
                                    point[2] + cells_.offset()[2]};
  for (std::size_t l = 0; l < covering_level_; ++l) {
    const Level& level = levels_[l];
    bool inside = true;
    for (std::size_t d = 0; d < 3; ++d) {
      const AxisNodes& line = level.line[d];
      inside = inside && (!line.open_low || place[d] >= line.begin) &&
               (!line.open_high || place[d] <= level.at(d, line.count - 1));
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
  Nodes nodes;
  nodes.step = level.step;
  nodes.stride = level.stride;
  nodes.plane = level.plane;
  for (std::size_t d = 0; d < 3; ++d) {
    nodes.first[d] = level.line[d].begin - cells_.offset()[d];
    nodes.count[d] = level.line[d].count;
    nodes.open_low[d] = level.line[d].open_low;
    nodes.open_high[d] = level.line[d].open_high;
    nodes.u[d] = level.u[d].data() + level.first_row();
  }
  return nodes;
}

std::size_t CompositeGrid::memory_bytes() const {
  std::size_t bytes =
      levels_.capacity() * sizeof(Level) + pressed_.capacity() * sizeof(Pressed) + cells_.memory_bytes();
  const auto add = [&bytes](const Level& level) {
    for (const auto* arrays :
         {&level.u, &level.held, &level.weight, &level.hold, &level.tissue, &level.inverse, &level.all}) {
      for (const Floats& array : *arrays) bytes += array.capacity() * sizeof(float);
    }
    for (const Floats* array : {&level.f, &level.old, &level.residual, &level.is_free, &level.is_active,
                                &level.active_stiffness, &level.inverse_with_active, &level.bound[0], &level.bound[1]})
      bytes += array->capacity() * sizeof(float);
    bytes += level.ghosts.capacity() * sizeof(Ghost) + level.beside.capacity() * sizeof(std::uint32_t);
  };
  const auto add_limits = [&bytes](const Level& level) {
    for (const auto* arrays : {&level.reach, &level.link[0], &level.link[1], &level.link[2],
                               &level.held_link[0], &level.held_link[1], &level.held_link[2]}) {
      for (const Floats& array : *arrays) bytes += array.capacity() * sizeof(float);
    }
  };
  for (const Level& level : levels_) {
    add(level);
    add_limits(level);
  }
  add(before_move_);
  add_limits(before_move_);
  for (const HalfCells& plane : half_cells_) {
    for (const Floats* part : {&plane.cells, &plane.stiff[0], &plane.stiff[1], &plane.stiff[2]})
      bytes += part->capacity() * sizeof(float);
  }
  return bytes;
}

void CompositeGrid::interpolate_from(const CompositeGrid& other) noexcept {
  for (Level& level : levels_) {
    const auto& line = level.line;
    for (int k = 0; k < line[2].count; ++k) {
      for (int j = 0; j < line[1].count; ++j) {
        for (int i = 0; i < line[0].count; ++i) {
          const std::size_t n = level.node(i, j, k);
          const auto& offset = cells_.offset();
          const glm::dvec3 u =
              other.at({level.at(0, i) - offset[0], level.at(1, j) - offset[1], level.at(2, k) - offset[2]});
          for (std::size_t a = 0; a < 3; ++a)
            level.u[a][n] = level.inverse[a][n] != 0.0F || line[a].open_low || line[a].open_high
                                ? static_cast<float>(u[static_cast<int>(a)])
                                : 0.0F;
        }
      }
    }
  }
}

}  // namespace voxel
