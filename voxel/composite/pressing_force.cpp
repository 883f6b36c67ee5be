// SPDX-License-Identifier: GPL-3.0-or-later
// The force of the tool on a CompositeGrid: the force that balances links and loads within one patch.
//
// In most contacts this patch is that of level 0. In deep presses, chains at their limits pass the tool's
// force on to nodes further away. Then it is the patch that covers the object, whose sides are anchors alone.
// That patch would serve for all contacts, but is less exact. Where links of a coarse level differ from those
// of the finer one, as at gaps, the sum of forces has an error at the side of the finer patch.
#include <cmath>

#include "voxel/composite/grid.h"
#include "voxel/composite/row_kernels.h"

namespace voxel {
namespace {

using composite::index;

// Share of the force on level 0 that bounds of a coarser level must have to count.
constexpr double kHeldOutside = 0.02;

}  // namespace

// Measures the force of the tool and of rigid surfaces on the nodes of a patch along one axis, after a cycle
// on that axis.
void CompositeGrid::measure_pressing_force(std::size_t a) noexcept {
  double force_N = force_on_patch(0, a);
  const double least_N = kHeldOutside * std::fabs(force_N);
  std::size_t l = 0;
  for (std::size_t outer = covering_level_; outer > 0 && l == 0; --outer) {
    if (std::fabs(force_of_tool_bounds(outer, a)) > least_N) l = covering_level_;
  }
  if (l > 0) force_N = force_on_patch(l, a);
  pressing_force_N_[static_cast<int>(a)] = force_N;
  pressed_level_[a] = l;
}

// Force of the tool's bounds on the nodes of a coarse level outside the finer patch (N).
double CompositeGrid::force_of_tool_bounds(std::size_t l, std::size_t a) noexcept {
  const composite::LevelView v = view(l, a);
  if (v.lower == nullptr && v.negated_upper == nullptr) return 0.0;
  Index3 finer_first{}, finer_last{};
  for (std::size_t d = 0; d < 3; ++d) {
    finer_first[d] = levels_[l - 1].nodes[d].coarse_first;
    finer_last[d] = levels_[l - 1].nodes[d].coarse_last;
  }
  composite::link_forces_of_level(v, v.first, v.last);
  double force_N = composite::force_of_bounds(v, finer_first, finer_last);
  for (const ObstacleBound& b : obstacle_bounds_) {
    if (b.level == l && b.axis == a) force_N -= static_cast<double>(b.force_N);
  }
  return force_N;
}

// Force that balances the links and loads of a patch's unknowns (N). Forces of links and bricks between two
// unknowns cancel, so finer patches have no effect. The bricks' forces on all nodes of the patch sum to zero,
// so the loads of the unknowns are minus those of the other nodes.
double CompositeGrid::force_on_patch(std::size_t l, std::size_t a) noexcept {
  Level& level = levels_[l];
  const auto& nodes = level.nodes;
  const composite::LevelView v = view(l, a);
  composite::link_forces_of_level(v, v.first, v.last);
  double sum = 0.0;
  for (int k = 0; k < nodes[2].count; ++k) {
    for (int j = 0; j < nodes[1].count; ++j) {
      const bool unknown =
          k >= nodes[2].first && k <= nodes[2].last && j >= nodes[1].first && j <= nodes[1].last;
      if (!unknown && !has_bricks_) continue;
      const std::size_t first = level.node(0, j, k), end = first + index(nodes[0].count);
      float of_row = 0.0F;
      for (std::size_t n = first; n < end; ++n) {
        const bool moves = level.inverse_diagonal[a][n] != 0.0F;
        if (moves) of_row -= level.residual[n];
        if (!moves && has_bricks_) of_row += level.brick_load[a][n];
      }
      sum += static_cast<double>(of_row);
    }
  }
  return sum;
}

glm::dvec3 CompositeGrid::force_on_tool_N() const noexcept {
  glm::dvec3 on_tool_N = -pressing_force_N_;
  for (const ObstacleBound& b : obstacle_bounds_) {
    const glm::dvec3 force_N = force_of(b);
    for (std::size_t a = 0; a < 3; ++a) {
      if (b.level <= pressed_level_[a]) on_tool_N[static_cast<int>(a)] += force_N[static_cast<int>(a)];
    }
  }
  return on_tool_N;
}

// The anchors bear the part of the tool's force that rigid surfaces do not bear.
glm::dvec3 CompositeGrid::force_on_anchors_N() const noexcept {
  glm::dvec3 on_anchors_N = -force_on_tool_N();
  for (const ObstacleBound& b : obstacle_bounds_) on_anchors_N += force_of(b);
  return on_anchors_N;
}

}  // namespace voxel
