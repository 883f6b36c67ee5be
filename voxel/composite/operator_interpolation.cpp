// SPDX-License-Identifier: GPL-3.0-or-later
// Operator interpolation between the levels of a CompositeGrid, where tissues differ in stiffness
// (transfer.h). Weights of links include their multipliers. Without the multipliers a tool that slides over
// compressed fat feels steps.
#include <algorithm>

#include "voxel/composite/grid.h"
#include "voxel/composite/row_kernels.h"
#include "voxel/composite/transfer.h"

namespace voxel {
namespace {

using composite::index;

}  // namespace

// Weights of the links along d before and after row (j, k); null: not in this level.
std::array<const float*, 2> CompositeGrid::weights_beside(const Level& level, std::size_t axis, std::size_t d,
                                                          int j, int k) const noexcept {
  if (j < 0 || k < 0 || j >= level.nodes[1].count || k >= level.nodes[2].count) return {};
  const float* const own = weights_on(level, axis)[d].data() + level.row(j, k);
  return {(d == 1 ? j : k) > 0 ? own - level.stride_along(d) : nullptr, own};
}

// prolong_row() with operator interpolation.
void CompositeGrid::prolong_row_by_links(const composite::ProlongArgs& args, const Level& fine,
                                         const Level& coarse, std::size_t axis, const float* from, int j,
                                         int k) const noexcept {
  const auto& nodes = fine.nodes;
  composite::ProlongByLinksArgs by{};
  by.between_y = nodes[1].weight_after[index(j)] != 0.0F;
  by.between_z = nodes[2].weight_after[index(k)] != 0.0F;
  for (int corner = 0; corner < 4; ++corner) {
    const int dj = corner & 1, dk = corner >> 1;
    if ((dj != 0 && !by.between_y) || (dk != 0 && !by.between_z)) continue;
    by.rows[index(corner)] =
        from + coarse.row(nodes[1].coarse[index(j)] + dj, nodes[2].coarse[index(k)] + dk) + nodes[0].base;
    const int own_j = by.between_y ? j - 1 + 2 * dj : j, own_k = by.between_z ? k - 1 + 2 * dk : k;
    by.link_x[index(corner)] = weights_beside(fine, axis, 0, own_j, own_k)[1];
    if (dj == 0) by.link_y[index(dk)] = weights_beside(fine, axis, 1, j, own_k);
  }
  by.link_z = weights_beside(fine, axis, 2, j, k);
  composite::prolong_row_by_links(args, by);
}

// Operator interpolation at a single node, for the nodes on a patch's sides in x.
float CompositeGrid::prolonged_by_links(const Level& fine, const Level& coarse, std::size_t axis,
                                        const float* from, int i, int j, int k) const noexcept {
  const auto& nodes = fine.nodes;
  const bool between_y = nodes[1].weight_after[index(j)] != 0.0F,
             between_z = nodes[2].weight_after[index(k)] != 0.0F;
  const auto mean = [&](float before, float after, std::size_t d, int own_k) {
    const auto [link_before, link_after] = weights_beside(fine, axis, d, j, own_k);
    const float a = link_before != nullptr ? link_before[i] : 0.0F,
                b = link_after != nullptr ? link_after[i] : 0.0F;
    const float weight = a > 0.0F && b > 0.0F ? b / (a + b) : 0.5F;
    return before + weight * (after - before);
  };
  const std::size_t at =
      coarse.node(nodes[0].coarse[index(i)], nodes[1].coarse[index(j)], nodes[2].coarse[index(k)]);
  const auto in_plane = [&](int dk) {
    const std::size_t own = at + index(dk) * coarse.plane;
    if (!between_y) return from[own];
    return mean(from[own], from[own + coarse.stride], 1, between_z ? k - 1 + 2 * dk : k);
  };
  return between_z ? mean(in_plane(0), in_plane(1), 2, k) : in_plane(0);
}

// restrict_values() with operator interpolation.
void CompositeGrid::restrict_by_links(Level& coarse, const Level& fine, std::size_t axis, const float* from,
                                      float* to) const noexcept {
  const auto& nodes = fine.nodes;
  constexpr std::size_t kEnd = 8;  // padding lanes before the first and after the last
  std::array<float, std::size_t{composite::kMaxVectors} * kLanes + 2 * kEnd> sum, upper_share;
  composite::RestrictArgs g{};
  g.vectors = static_cast<int>(fine.stride / kLanes);
  g.sum = sum.data() + kEnd;
  g.upper_share = upper_share.data() + kEnd;
  std::fill_n(sum.begin(), kEnd, 0.0F);
  std::fill_n(g.sum + fine.stride, kEnd, 0.0F);
  std::fill_n(upper_share.begin(), kEnd, 0.5F);
  std::fill_n(g.upper_share + fine.stride, kEnd, 0.5F);
  for (int k = nodes[2].coarse_first; k <= nodes[2].coarse_last; ++k) {
    const int fk = nodes[2].fine[index(k)];
    g.share_z = {nodes[2].restrict_low[index(k)], nodes[2].restrict_own[index(k)],
                 nodes[2].restrict_high[index(k)]};
    for (int j = nodes[1].coarse_first; j <= nodes[1].coarse_last; ++j) {
      const int fj = nodes[1].fine[index(j)];
      g.share_y = {nodes[1].restrict_low[index(j)], nodes[1].restrict_own[index(j)],
                   nodes[1].restrict_high[index(j)]};
      for (int dj = -1; dj <= 1; ++dj) {
        const std::size_t y = index(dj + 1);
        g.link_y[y] = weights_beside(fine, axis, 1, fj + dj, fk);
        for (int dk = -1; dk <= 1; ++dk) {
          const std::size_t z = index(dk + 1);
          const auto links = weights_beside(fine, axis, 2, fj + dj, fk + dk);
          g.link_z[z][y] = links;
          g.rows[z][y] = links[1] != nullptr ? from + fine.row(fj + dj, fk + dk) : nullptr;
        }
      }
      g.link_x = weights_beside(fine, axis, 0, fj, fk)[1];
      composite::restrict_row_by_links(g);
      float* f = to + coarse.row(j, k);
      for (int i = nodes[0].coarse_first; i <= nodes[0].coarse_last; ++i) {
        const int at = nodes[0].fine[index(i)];
        const float low = nodes[0].restrict_low[index(i)], high = nodes[0].restrict_high[index(i)];
        const float of_low = low == 0.5F ? g.upper_share[at - 1] : low,
                    of_high = high == 0.5F ? 1.0F - g.upper_share[at + 1] : high;
        f[i] = nodes[0].restrict_own[index(i)] * g.sum[at] + of_low * g.sum[at - 1] + of_high * g.sum[at + 1];
      }
    }
  }
  distribute_ghost_loads(coarse, to);
}

}  // namespace voxel
