// SPDX-License-Identifier: GPL-3.0-or-later
// Of one cycle over a composite grid, what goes from level to level where tissues differ in stiffness: a node
// between two coarse ones goes by its links (transfer.h), as stiff as they are at their limits. (By
// what they are within these a tool that slid over squeezed fat felt steps of up to 0.34 N.)
#include <algorithm>

#include "voxel/composite/grid.h"
#include "voxel/composite/row_kernels.h"
#include "voxel/composite/transfer.h"

namespace voxel {
namespace {

std::size_t index(int i) {
  return static_cast<std::size_t>(i);
}

}  // namespace

// Links to the rows before and after one, along d; null: not of this level.
std::array<const float*, 2> CompositeGrid::weights_beside(const Level& level, std::size_t axis, std::size_t d,
                                                        int j, int k) const noexcept {
  if (j < 0 || k < 0 || j >= level.line[1].count || k >= level.line[2].count) return {};
  const float* const own = weights_on(level, axis)[d].data() + level.row(j, k);
  return {(d == 1 ? j : k) > 0 ? own - level.by(d) : nullptr, own};
}

// What prolong_row() does, by links.
void CompositeGrid::prolong_row_by_links(const composite::ProlongArgs& args, const Level& fine,
                                      const Level& coarse, std::size_t axis, const float* from, int j,
                                      int k) const noexcept {
  const auto& line = fine.line;
  composite::ProlongByLinksArgs by{};
  by.between_y = line[1].part[index(j)] != 0.0F;
  by.between_z = line[2].part[index(k)] != 0.0F;
  for (int corner = 0; corner < 4; ++corner) {
    const int dj = corner & 1, dk = corner >> 1;
    if ((dj != 0 && !by.between_y) || (dk != 0 && !by.between_z)) continue;
    by.rows[index(corner)] =
        from + coarse.row(line[1].coarse[index(j)] + dj, line[2].coarse[index(k)] + dk) + line[0].base;
    const int own_j = by.between_y ? j - 1 + 2 * dj : j, own_k = by.between_z ? k - 1 + 2 * dk : k;
    by.along_x[index(corner)] = weights_beside(fine, axis, 0, own_j, own_k)[1];
    if (dj == 0) by.along_y[index(dk)] = weights_beside(fine, axis, 1, j, own_k);
  }
  by.along_z = weights_beside(fine, axis, 2, j, k);
  composite::prolong_row_by_links(args, by);
}

// What tell() does at the ends of a box along x, by links.
float CompositeGrid::prolonged_by_links(const Level& fine, const Level& coarse, std::size_t axis,
                                   const float* from, int i, int j, int k) const noexcept {
  const auto& line = fine.line;
  const bool between_y = line[1].part[index(j)] != 0.0F, between_z = line[2].part[index(k)] != 0.0F;
  const auto mean = [&](float before, float after, std::size_t d, int own_k) {
    const auto [link_before, link_after] = weights_beside(fine, axis, d, j, own_k);
    const float a = link_before != nullptr ? link_before[i] : 0.0F,
                b = link_after != nullptr ? link_after[i] : 0.0F;
    const float part = a > 0.0F && b > 0.0F ? b / (a + b) : 0.5F;
    return before + part * (after - before);
  };
  const std::size_t at =
      coarse.node(line[0].coarse[index(i)], line[1].coarse[index(j)], line[2].coarse[index(k)]);
  const auto in_plane = [&](int dk) {
    const std::size_t own = at + index(dk) * coarse.plane;
    if (!between_y) return from[own];
    return mean(from[own], from[own + coarse.stride], 1, between_z ? k - 1 + 2 * dk : k);
  };
  return between_z ? mean(in_plane(0), in_plane(1), 2, k) : in_plane(0);
}

// What restrict_values() does, by links.
void CompositeGrid::restrict_by_links(Level& coarse, const Level& fine, std::size_t axis, const float* from,
                                      float* to) const noexcept {
  const auto& line = fine.line;
  constexpr std::size_t kEnd = 8;  // lanes before the first and after the last
  std::array<float, std::size_t{composite::kMaxOctets} * kOctet + 2 * kEnd> sum, part;
  composite::RestrictArgs g{};
  g.octets = static_cast<int>(fine.stride / kOctet);
  g.sum = sum.data() + kEnd;
  g.part = part.data() + kEnd;
  std::fill_n(sum.begin(), kEnd, 0.0F);
  std::fill_n(g.sum + fine.stride, kEnd, 0.0F);
  std::fill_n(part.begin(), kEnd, 0.5F);
  std::fill_n(g.part + fine.stride, kEnd, 0.5F);
  for (int k = line[2].coarse_first; k <= line[2].coarse_last; ++k) {
    const int fk = line[2].fine[index(k)];
    g.share_z = {line[2].from_low[index(k)], line[2].from_own[index(k)], line[2].from_high[index(k)]};
    for (int j = line[1].coarse_first; j <= line[1].coarse_last; ++j) {
      const int fj = line[1].fine[index(j)];
      g.share_y = {line[1].from_low[index(j)], line[1].from_own[index(j)], line[1].from_high[index(j)]};
      for (int dj = -1; dj <= 1; ++dj) {
        const std::size_t y = index(dj + 1);
        g.along_y[y] = weights_beside(fine, axis, 1, fj + dj, fk);
        for (int dk = -1; dk <= 1; ++dk) {
          const std::size_t z = index(dk + 1);
          const auto links = weights_beside(fine, axis, 2, fj + dj, fk + dk);
          g.along_z[z][y] = links;
          g.rows[z][y] = links[1] != nullptr ? from + fine.row(fj + dj, fk + dk) : nullptr;
        }
      }
      g.along_x = weights_beside(fine, axis, 0, fj, fk)[1];
      composite::restrict_row_by_links(g);
      float* f = to + coarse.row(j, k);
      for (int i = line[0].coarse_first; i <= line[0].coarse_last; ++i) {
        const int at = line[0].fine[index(i)];
        const float low = line[0].from_low[index(i)], high = line[0].from_high[index(i)];
        const float of_low = low == 0.5F ? g.part[at - 1] : low,
                    of_high = high == 0.5F ? 1.0F - g.part[at + 1] : high;
        f[i] = line[0].from_own[index(i)] * g.sum[at] + of_low * g.sum[at - 1] + of_high * g.sum[at + 1];
      }
    }
  }
  gather_from_ghosts(coarse, to);
}

}  // namespace voxel
