// SPDX-License-Identifier: GPL-3.0-or-later
// Sheets and rows of single voxels as the levels of a CompositeGrid see them (coarse_material.h). A cell is
// as stiff as the softest of its voxels, so such tissue fills no cell of its own. On level 0 the links
// of such tissue are those of the lattice. On coarse levels the excess of a link is shared among its cells,
// as stiffness along the link.
#include <algorithm>
#include <bit>

#include "voxel/composite/coarse_material.h"
#include "voxel/lattice/link_stiffness.h"

namespace voxel {
namespace {

using composite::index;

}  // namespace

// Only rows with a voxel at a surface or beside another tissue have such links.
void CoarseMaterial::list_thin_links() {
  if (fills_box_ && !is_heterogeneous()) return;
  const Grid& g = lattice_.grid();
  for (RowId row = 0; row < g.rows(); ++row) {
    if (lattice_.filled_in(row) == 0 || lattice_.inside(row) != 0) continue;
    for (std::uint32_t lanes = lattice_.filled_lanes(row); lanes != 0; lanes &= lanes - 1) {
      const Index3 p = lattice_.coordinates(row * kRow + static_cast<VoxelId>(std::countr_zero(lanes)));
      for (std::size_t d = 0; d < 3; ++d) add_thin_link(p, d);
    }
  }
  sort_by_cube(thin_links_);
}

void CoarseMaterial::add_thin_link(const Index3& voxel, std::size_t d) {
  const std::size_t e = (d + 1) % 3, f = (d + 2) % 3;
  // Rank of the softer end of the parallel link at offset (p, q); 0: there is none.
  const auto rank_at = [&](int p, int q) {
    Index3 from = voxel;
    from[e] += p;
    from[f] += q;
    Index3 to = from;
    ++to[d];
    return std::min(rank_[lattice_.label(lattice_.at(from[0], from[1], from[2]))],
                    rank_[lattice_.label(lattice_.at(to[0], to[1], to[2]))]);
  };
  const std::uint8_t own = rank_at(0, 0);
  if (own == 0) return;
  int cells = 0;
  for (const int p : {-1, 1}) {
    for (const int q : {-1, 1}) {
      const std::uint8_t rank = std::min({rank_at(p, 0), rank_at(0, q), rank_at(p, q)});
      if (rank >= own) return;
      cells += rank > 0 ? 1 : 0;
    }
  }
  std::array<LinkModuli, 9> links, alike;
  for (int n = 0; n < 9; ++n) {
    const std::uint8_t rank = rank_at(n % 3 - 1, n / 3 - 1);
    const double stiffness = static_cast<double>(stiffness_[rank]), one = rank > 0 ? 1.0 : 0.0;
    links[index(n)] = {stiffness, stiffness};
    alike[index(n)] = {one, one};
  }
  PackedLink link{{}, static_cast<std::uint8_t>(d)};
  link.excess = static_cast<float>(link_parts(links).thin.along_Pa);
  link.shape = static_cast<float>(link_parts(alike).thin.along_Pa);
  link.share = cells > 0 ? link.excess / static_cast<float>(cells) : 0.0F;
  for (std::size_t a = 0; a < 3; ++a) link.voxel[a] = static_cast<std::uint16_t>(voxel[a]);
  if (link.excess > 0.0F) thin_links_.items.push_back(link);
}

}  // namespace voxel
