// SPDX-License-Identifier: GPL-3.0-or-later
// Springs that keep the corrections of a CompositeGrid's coarse levels from going too far (grid.h).
#include <algorithm>

#include "voxel/composite/grid.h"

namespace voxel {
namespace {

using composite::index;

constexpr std::array<std::size_t, 3> kToNext{1, 5, 25};  // from a NodeWeights entry to the next one along d

}  // namespace

// Where tissues differ, weights between two coarse nodes follow from links, one axis after the other
// (operator_interpolation.cpp).
CompositeGrid::NodeWeights CompositeGrid::weights_of_node(const Level& fine,
                                                          const Index3& node) const noexcept {
  std::array<std::array<float, 3>, 3> share{};  // along each axis at −1, 0, 1, without regard to tissues
  Index3 middle{};
  for (std::size_t d = 0; d < 3; ++d) {
    const auto c = index(node[d]);
    share[d] = {fine.nodes[d].restrict_low[c], fine.nodes[d].restrict_own[c], fine.nodes[d].restrict_high[c]};
    middle[d] = fine.nodes[d].fine[c];
  }
  // Share of the coarse node along d at a fine node that lies on its side `t` (−1, 0, 1).
  const auto along = [&](std::size_t d, int t, std::size_t n) {
    const float plain = share[d][index(t + 1)];
    if (t == 0 || plain != 0.5F || !material_.is_heterogeneous()) return plain;
    const auto& weight = fine.weight[d];
    const float before = weight[n - fine.stride_along(d)], after = weight[n];
    if (before == 0.0F || after == 0.0F) return plain;
    return (t < 0 ? after : before) / (before + after);
  };
  const std::size_t at = fine.node(middle[0], middle[1], middle[2]);
  NodeWeights weights{};
  for (int i = -1; i <= 1; ++i) {
    if (share[0][index(i + 1)] == 0.0F) continue;
    const std::size_t of_x = at + index(i + 1) - 1;
    const float x = along(0, i, of_x);
    for (int j = -1; j <= 1; ++j) {
      if (share[1][index(j + 1)] == 0.0F) continue;
      const std::size_t of_y = of_x + index(j + 1) * fine.stride - fine.stride;
      const float xy = x * along(1, j, of_y);
      for (int k = -1; k <= 1; ++k) {
        if (share[2][index(k + 1)] == 0.0F) continue;
        const std::size_t of_z = of_y + index(k + 1) * fine.plane - fine.plane;
        weights[index(i + 2 + 5 * (j + 2) + 25 * (k + 2))] = xy * along(2, k, of_z);
      }
    }
  }
  return weights;
}

// Stiffness along d with which the fine level resists the prolonged correction of one coarse node. A link
// counts by the squared difference of the interpolation weights at its ends, an anchor by the interpolation
// weight of its node. middle: the fine node at the coarse node's place.
float CompositeGrid::prolonged_weight(const Level& fine, std::size_t middle, std::size_t d,
                                      const NodeWeights& of_node) noexcept {
  const std::size_t e = (d + 1) % 3, f = (d + 2) % 3;
  const std::array<std::size_t, 3> by{1, fine.stride, fine.plane};
  float sum = 0.0F;
  for (std::size_t q = 1; q <= 3; ++q) {
    for (std::size_t p = 1; p <= 3; ++p) {
      std::size_t own = p * kToNext[e] + q * kToNext[f];
      std::size_t n = middle + p * by[e] + q * by[f] - 2 * (by[d] + by[e] + by[f]);
      float before = 0.0F;
      for (std::size_t t = 0; t < 4; ++t, n += by[d]) {
        own += kToNext[d];
        // Places beyond the patch have the weight 0 and may lie outside the arrays.
        const bool is_free = of_node[own] != 0.0F && fine.inverse_diagonal[0][n + by[d]] != 0.0F;
        const float after = is_free ? of_node[own] : 0.0F;
        if (after != 0.0F || before != 0.0F) sum += fine.weight[d][n] * (after - before) * (after - before);
        if (after != 0.0F) sum += fine.anchor_weight[d][n + by[d]] * after;
        before = after;
      }
    }
  }
  return sum;
}

// A coarse level is a discretisation of its own. Its links may be weaker than the fine level's stiffness
// against a prolonged correction: at a node that barely touches the tissue, at links across a gap, at
// anchors, beside thin stiff tissue. A correction would then go too far. There a spring of the missing
// stiffness holds the node at its present displacement. The spring does not change the solution.
void CompositeGrid::find_correction_springs(const Level& fine, Level& coarse) const noexcept {
  coarse.correction_springs.clear();
  if (material_.fills_box() && !material_.is_heterogeneous() && !material_.has_scattered_anchors()) return;
  const auto& nodes = fine.nodes;
  for (int k = nodes[2].coarse_first; k <= nodes[2].coarse_last; ++k) {
    for (int j = nodes[1].coarse_first; j <= nodes[1].coarse_last; ++j) {
      for (int i = nodes[0].coarse_first; i <= nodes[0].coarse_last; ++i) {
        const std::size_t n = coarse.node(i, j, k);
        if (coarse.inverse_diagonal[0][n] == 0.0F) continue;
        const std::size_t middle =
            fine.node(nodes[0].fine[index(i)], nodes[1].fine[index(j)], nodes[2].fine[index(k)]);
        const NodeWeights of_node = weights_of_node(fine, {i, j, k});
        CorrectionSpring spring{static_cast<std::uint32_t>(n), {}};
        bool any = false;
        for (std::size_t d = 0; d < 3; ++d) {
          const auto& weight = coarse.weight[d];
          const float own = weight[n] + weight[n - coarse.stride_along(d)] + coarse.anchor_weight[d][n];
          spring.weight[d] = std::max(prolonged_weight(fine, middle, d, of_node) - own, 0.0F);
          any = any || spring.weight[d] > 0.0F;
        }
        if (any && coarse.correction_springs.size() < coarse.correction_springs.capacity())
          coarse.correction_springs.push_back(spring);
      }
    }
  }
}

}  // namespace voxel
