// SPDX-License-Identifier: GPL-3.0-or-later
// Bounds of the nodes of a CompositeGrid: cones from the pressed voxels, along existing links (grid.h).
#include <algorithm>
#include <cmath>

#include "voxel/composite/grid.h"
#include "voxel/composite/row_kernels.h"

namespace voxel {
namespace {

using composite::index;

using composite::kNoBound;

// Rounds of sweeps on a level with gaps or anchors: paths around a gap have more bends than one round
// follows.
constexpr int kRoundsRoundGaps = 2;

}  // namespace

// Box of the nodes of a level that bounds of pressed voxels may reach. `pressed`: box of these voxels
// (coordinates). A bound falls from link to link along a chain. Outside of the returned box it has fallen by
// more than `fall_m` (m), so that it holds no node.
CompositeGrid::NodeBox CompositeGrid::reach_of_bounds(const Level& level, std::size_t a, std::size_t kind,
                                                      const NodeBox& pressed, float fall_m) const noexcept {
  NodeBox box;
  for (std::size_t d = 0; d < 3; ++d) {
    const auto& nodes = level.nodes[d];
    const int all = level.step * nodes.count;
    const auto voxels = [&](std::size_t side) {
      const float fall = limit_m_[d][a][side ^ kind].tightest;
      return fall > 0.0F ? static_cast<int>(std::min(fall_m / fall, static_cast<float>(all))) + 1 : all;
    };
    const int low = pressed.low[d] - voxels(1) - nodes.begin,
              high = pressed.high[d] + voxels(0) - nodes.begin;
    box.low[d] = std::max(low + level.step - 1, 0) / level.step;
    box.high[d] = high < 0 ? -1 : std::min(high / level.step, nodes.count - 1);
  }
  return box;
}

// Propagates bounds within `box` by alternating sweeps. Without gaps a shortest path takes one axis after
// another, and one round finds it. Where links are missing, paths with more bends than the rounds can follow
// are missed.
void CompositeGrid::propagate_bounds(Level& level, std::size_t a, std::size_t kind,
                                     const NodeBox& box) const noexcept {
  const std::size_t from = level.first_row();
  composite::BoundSweep sweep{};
  sweep.bound = level.bound[kind].data() + from;
  for (std::size_t d = 0; d < 3; ++d) {
    sweep.weight[d] = level.weight[d].data() + from;
    sweep.fall_up[d] = limit_of_links(level, a, d, kind);
    sweep.fall_down[d] = limit_of_links(level, a, d, 1 - kind);
  }
  sweep.low = box.low;
  sweep.high = box.high;
  sweep.stride = level.stride;
  sweep.plane = level.plane;
  const int rounds = level.has_gaps || level.has_anchors ? kRoundsRoundGaps : 1;
  for (int round = 0; round < rounds; ++round) composite::sweep_bounds(sweep);
}

void CompositeGrid::find_bounds(std::size_t a) noexcept {
  const int axis = static_cast<int>(a);
  for (std::size_t kind = 0; kind < 2; ++kind) {
    const float sign = kind == 0 ? 1.0F : -1.0F;
    for (Level& level : levels_) level.bounded[kind] = false;
    float strongest = kNoBound;
    NodeBox pressed{{1 << 20, 1 << 20, 1 << 20}, {-1, -1, -1}};  // coordinates
    const auto constrains = [&](const Pressed& p) { return sign * p.normal[axis] > kAlong; };
    for (const Pressed& p : pressed_) {
      if (!constrains(p)) continue;
      strongest = std::max(strongest, sign * p.u[axis]);
      for (std::size_t d = 0; d < 3; ++d) {
        pressed.low[d] = std::min(pressed.low[d], levels_[0].at(d, p.node[d]));
        pressed.high[d] = std::max(pressed.high[d], levels_[0].at(d, p.node[d]));
      }
    }
    if (strongest == kNoBound) continue;
    for (Level& level : levels_) {
      std::fill_n(level.bound[kind].begin(), level.first_row() + level.floats() + kPad, kNoBound);
      level.bounded[kind] = true;
    }
    for (const Pressed& p : pressed_) {
      if (!constrains(p)) continue;
      float& at = levels_[0].bound[kind][levels_[0].node(p.node[0], p.node[1], p.node[2])];
      at = std::max(at, sign * p.u[axis]);
    }
    // A bound that has fallen by more than fall_m lies below all displacements, so it holds no node.
    const float fall_m = strongest + std::max(std::abs(strongest), largest_displacement(a));
    NodeBox finer_reach;
    for (std::size_t l = 0; l < levels_.size(); ++l) {
      const NodeBox reach = reach_of_bounds(levels_[l], a, kind, pressed, fall_m);
      if (l > 0) hand_on_bounds(l - 1, kind, finer_reach);
      propagate_bounds(levels_[l], a, kind, reach);
      // A coarse level may have links across gaps that the finer level does not have. So its nodes under the
      // finer patch get the finer level's bounds once more.
      if (l > 0) hand_on_bounds(l - 1, kind, finer_reach);
      finer_reach = reach;
    }
  }
}

// Nodes of the next level that coincide with nodes of `reach` take their bounds.
void CompositeGrid::hand_on_bounds(std::size_t l, std::size_t kind, const NodeBox& reach) noexcept {
  const Level& fine = levels_[l];
  Level& coarse = levels_[l + 1];
  const auto& nodes = fine.nodes;
  NodeBox box;
  for (std::size_t d = 0; d < 3; ++d) {
    box.low[d] = coarse.nodes[d].count;
    box.high[d] = -1;
    for (int c = 0; c < coarse.nodes[d].count; ++c) {
      const int here = nodes[d].fine[index(c)];
      if (here < reach.low[d] || here > reach.high[d]) continue;
      box.low[d] = std::min(box.low[d], c);
      box.high[d] = std::max(box.high[d], c);
    }
  }
  for (int k = box.low[2]; k <= box.high[2]; ++k) {
    for (int j = box.low[1]; j <= box.high[1]; ++j) {
      const float* from =
          fine.bound[kind].data() + fine.row(nodes[1].fine[index(j)], nodes[2].fine[index(k)]);
      float* to = coarse.bound[kind].data() + coarse.row(j, k);
      for (int i = box.low[0]; i <= box.high[0]; ++i) to[i] = from[nodes[0].fine[index(i)]];
    }
  }
}

float CompositeGrid::largest_displacement(std::size_t a) const noexcept {
  float largest = 0.0F;
  for (const Level& level : levels_)
    largest =
        std::max(largest, composite::largest_size(level.u[a].data() + level.first_row(), level.floats()));
  return largest;
}

}  // namespace voxel
