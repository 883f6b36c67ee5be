// SPDX-License-Identifier: GPL-3.0-or-later
// Springs that keep the corrections of a CompositeGrid's coarse levels from going too far (grid.h).
#include <algorithm>

#include "voxel/composite/grid.h"

namespace voxel {
namespace {

using composite::index;

// A node needs no spring on an axis if its two links there have at least this share of the weight of two full
// links. In tissue without gaps the coarse node's links are stiffer than the fine level: the fine level's
// stiffness against a prolonged correction is only 9/16 of that of the node's own links.
constexpr float kRegular = 0.999F;

}  // namespace

// Stiffness along d with which the links of the fine level resist a correction of one coarse node, once it is
// prolonged. A link counts by the squared difference of the interpolation weights at its ends, an anchor by
// the interpolation weight of its node.
float CompositeGrid::prolonged_weight(const Level& fine, const Index3& node, std::size_t d,
                                      float stiffness) const noexcept {
  std::array<std::array<float, 5>, 3> along{};  // interpolation weights at −2 … 2 fine nodes
  std::array<std::size_t, 3> by{};
  for (std::size_t e = 0; e < 3; ++e) {
    const auto c = index(node[e]);
    along[e] = {0.0F, fine.nodes[e].restrict_low[c], fine.nodes[e].restrict_own[c],
                fine.nodes[e].restrict_high[c], 0.0F};
    by[e] = fine.stride_along(e);
  }
  const std::size_t e = (d + 1) % 3, f = (d + 2) % 3;
  const std::size_t middle = fine.node(fine.nodes[0].fine[index(node[0])], fine.nodes[1].fine[index(node[1])],
                                       fine.nodes[2].fine[index(node[2])]);
  const auto& weight = shape_weights(fine)[d];
  const auto is_free = [&](std::size_t n) { return fine.inverse_diagonal[0][n] != 0.0F ? 1.0F : 0.0F; };
  float sum = 0.0F;
  for (std::size_t q = 1; q <= 3; ++q) {
    for (std::size_t p = 1; p <= 3; ++p) {
      const float across = along[e][p] * along[f][q];
      if (across == 0.0F) continue;
      std::size_t n = middle + p * by[e] + q * by[f] - 2 * (by[d] + by[e] + by[f]);
      float before = 0.0F;
      for (std::size_t t = 0; t < 4; ++t, n += by[d]) {
        // Places beyond the patch have the weight 0 and may lie outside the arrays.
        const float own = across * along[d][t + 1];
        const float after = own != 0.0F ? own * is_free(n + by[d]) : 0.0F;
        if (after != 0.0F || before != 0.0F)
          sum += weight[n] * (after - before) * (after - before) +
                 fine.anchor_weight[d][n + by[d]] / stiffness * after;
        before = after;
      }
    }
  }
  return sum;
}

// A coarse level is a discretisation of its own. Its links may be weaker than the fine level's stiffness
// against a prolonged correction: at a node that barely touches the tissue, at links across a gap, at
// anchors. A correction would then go too far. There a spring holds the node at its present displacement; its
// stiffness is the difference. The spring does not change the solution.
void CompositeGrid::find_correction_springs(const Level& fine, Level& coarse) const noexcept {
  coarse.correction_springs.clear();
  if (material_.fills_box() && !material_.has_scattered_anchors()) return;
  const auto& nodes = fine.nodes;
  for (int k = nodes[2].coarse_first; k <= nodes[2].coarse_last; ++k) {
    for (int j = nodes[1].coarse_first; j <= nodes[1].coarse_last; ++j) {
      for (int i = nodes[0].coarse_first; i <= nodes[0].coarse_last; ++i) {
        const std::size_t n = coarse.node(i, j, k);
        if (coarse.inverse_diagonal[0][n] == 0.0F) continue;
        CorrectionSpring spring{static_cast<std::uint32_t>(n), {}};
        bool any = false;
        // Links are compared by their tissue's shape, anchors by their weight over the tissue's stiffness.
        const float stiffness = stiffness_at(coarse, n);
        if (stiffness == 0.0F) continue;  // anchors alone hold the node
        for (std::size_t d = 0; d < 3; ++d) {
          const auto& weight = shape_weights(coarse)[d];
          const float own =
              weight[n] + weight[n - coarse.stride_along(d)] + coarse.anchor_weight[d][n] / stiffness;
          if (own >= kRegular * static_cast<float>(2 * coarse.step)) continue;
          spring.weight[d] =
              stiffness * std::max(prolonged_weight(fine, {i, j, k}, d, stiffness) - own, 0.0F);
          any = any || spring.weight[d] > 0.0F;
        }
        if (any && coarse.correction_springs.size() < coarse.correction_springs.capacity())
          coarse.correction_springs.push_back(spring);
      }
    }
  }
}

}  // namespace voxel
