// SPDX-License-Identifier: GPL-3.0-or-later
// Which objects can be solved on a CompositeGrid: by their materials and anchors, and by trial contacts.
#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "voxel/composite/grid.h"
#include "voxel/lattice/link_stiffness.h"

namespace voxel {
namespace {

using composite::index;

constexpr int kTrialHalfWidth = 10;      // of level 0 in trials
constexpr double kConverges = 0.85;      // largest convergence factor of the displacement per cycle
constexpr double kMaxForceError = 0.05;  // relative to the force on patches twice as wide
constexpr int kFromAnchors = 16;         // voxels that a contact keeps from anchors
constexpr double kMaxThinShare = 0.02;   // of the stiffness of links where tissues meet
constexpr double kMinAreaRatio = 0.8, kMaxAreaRatio = 1.25;  // of anchor_area_ratio()

// Is there a link without a cell on any side? Links in a sheet or a row of single voxels have none.
bool has_thin_blocks(const Lattice& lattice) {
  for (const VoxelId v : lattice.surface()) {
    const auto c = lattice.coordinates(v);
    std::uint32_t filled = 0;
    for (int n = 0; n < 27; ++n) {
      if (lattice.filled(lattice.at(c[0] + n % 3 - 1, c[1] + n / 3 % 3 - 1, c[2] + n / 9 - 1)))
        filled |= 1U << n;
    }
    for (int d = 0; d < 3; ++d) {
      if (!lattice.filled(lattice.up(v, d))) continue;
      const std::uint32_t parallels = parallel_links(filled, d);
      const auto there = [parallels](int p, int q) { return (parallels >> (p + 1 + 3 * (q + 1)) & 1U) != 0; };
      bool any = false;
      for (const int p : {-1, 1}) {
        for (const int q : {-1, 1}) any = any || (there(p, 0) && there(0, q) && there(p, q));
      }
      if (!any) return true;
    }
  }
  return false;
}

// Where tissues meet: share of the links' stiffness that belongs to tissue too thin to have a cell of its own
// stiffness (LinkParts::thin). CoarseMaterial knows cells only. Samples kRowsTried rows at most.
double thin_tissue_share(const Lattice& lattice) {
  constexpr RowId kRowsTried = 20000;
  const Grid& g = lattice.grid();
  RowId among = 0;
  for (RowId row = 0; row < g.rows(); ++row) among += lattice.filled_in(row) > 0 && lattice.inside(row) == 0;
  const RowId every = among / kRowsTried + 1;
  double thin = 0.0, all = 0.0;
  RowId number = 0;
  const auto moduli_at = [&](const std::array<int, 3>& c) {
    const std::uint8_t material = lattice.material(lattice.at(c[0], c[1], c[2]));
    if (material == 0) return LinkModuli{};
    const double young_Pa = lattice.materials()[material].young_Pa;
    return LinkModuli{young_Pa, young_Pa};
  };
  for (RowId row = 0; row < g.rows(); ++row) {
    if (lattice.filled_in(row) == 0 || lattice.inside(row) != 0 || number++ % every != 0) continue;
    for (std::uint32_t lanes = lattice.filled_lanes(row); lanes != 0; lanes &= lanes - 1) {
      const VoxelId v = row * kRow + static_cast<VoxelId>(std::countr_zero(lanes));
      for (std::size_t d = 0; d < 3; ++d) {
        if (!lattice.filled(lattice.up(v, static_cast<int>(d)))) continue;
        std::array<LinkModuli, 9> links;
        for (int n = 0; n < 9; ++n) {
          auto from = lattice.coordinates(v);
          from[(d + 1) % 3] += n % 3 - 1;
          from[(d + 2) % 3] += n / 3 - 1;
          auto to = from;
          ++to[d];
          links[index(n)] = softer(moduli_at(from), moduli_at(to));
        }
        const LinkParts parts = link_parts(links);
        thin += parts.thin.along_Pa;
        all += parts.thin.along_Pa + parts.cells.along_Pa;
      }
    }
  }
  return all > 0.0 ? thin / all : 0.0;
}

bool alike_in_poisson(std::span<const LinkMaterial> materials) {
  return std::all_of(materials.begin(), materials.end(),
                     [&](const LinkMaterial& m) { return m.poisson == materials.front().poisson; });
}

}  // namespace

std::string CompositeGrid::reason_unsuitable(const Lattice& lattice) {
  if (!lattice.uniform_limits()) return "its materials have limits of their own";
  if (!alike_in_poisson(lattice.materials().subspan(1))) return "its materials differ in Poisson's ratio";
  if (lattice.has_plasticity()) return "it keeps dents";
  if (lattice.has_bricks()) return "it is of the accurate energy";
  for (int d = 0; d < 3; ++d) {
    const LinkLimit& l = lattice.tightest(d);
    if (l.along_low >= 0.0F || l.along_high <= 0.0F || l.across <= 0.0F) return "its links have no slack";
  }
  if (has_thin_blocks(lattice)) return "parts of it are one voxel thick";
  if (lattice.materials().size() > 2 && thin_tissue_share(lattice) > kMaxThinShare)
    return "much of its stiffer tissue is one voxel thick";
  const CompositeGrid grid(lattice, kHalfWidth);
  // clamp_to_anchors() knows anchored sides only.
  if (!grid.anchored_by_sides()) return "it is anchored otherwise than by whole sides";
  const double seen = grid.anchor_area_ratio();
  if (seen < kMinAreaRatio || seen > kMaxAreaRatio) return "coarse levels do not see what anchors hold";
  return CompositeGrid(lattice, kTrialHalfWidth).trial_failure();
}

// Trials at places all over the surface. From a random state without a tool, cycles must converge to rest; a
// pressed voxel must feel the same force as with patches twice as wide. Objects fail if a slot or an
// inclusion is as wide as the spacing of a level: a prolonged correction may then stretch links that the
// level does not see.
std::string CompositeGrid::trial_failure() {
  constexpr std::size_t kPlaces = 12;
  constexpr int kCycles = 10, kFirst = 2, kPressedCycles = 24;
  constexpr double kDepth = 1.0;  // spacings
  CompositeGrid wide(lattice_, 2 * kTrialHalfWidth, 2 * kHalfWidth);
  const auto surface = lattice_.surface();
  // Random differences between neighbours stay below every limit, so that limits play no part.
  float least = std::numeric_limits<float>::max();
  for (const auto& d : limit_m_) {
    for (const auto& axis : d) least = std::min({least, axis[0], axis[1]});
  }
  const float most_m = 0.5F * least;
  // In heterogeneous objects multipliers may take a hundred cycles to converge, and say nothing about the
  // shape: so the press stays within limits.
  const double depth_m = material_.is_heterogeneous() ? most_m : kDepth * lattice_.min_spacing_m();
  for (std::size_t n = 0; n < kPlaces; ++n) {
    const VoxelId v = surface[(2 * n + 1) * surface.size() / (2 * kPlaces)];
    const Index3 place = lattice_.coordinates(v);
    if (lattice_.anchored(v)) continue;
    begin(place);
    std::uint32_t random = 1;
    for (Level& level : levels_) {
      for (std::size_t i = 0; i < level.inverse_diagonal[0].size(); ++i) {
        for (std::size_t a = 0; a < 3; ++a) {
          random = random * 1664525U + 1013904223U;
          level.u[a][i] = level.inverse_diagonal[a][i] > 0.0F
                              ? most_m * (static_cast<float>(random >> 8U) * 0x1p-24F - 0.3F)
                              : 0.0F;
        }
      }
    }
    double before = energy_J();
    for (int c = 0; c < kCycles; ++c) {
      cycle();
      const double now = energy_J();
      if (c >= kFirst && !(now < kConverges * kConverges * before))
        return "coarse levels do not come to rest";
      before = now;
    }
    const glm::dvec3 outward = lattice_.outward(v), size = glm::abs(outward);
    if (outward == glm::dvec3(0.0) || !far_from_anchors(place)) continue;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    glm::dvec3 normal(0.0);
    normal[axis] = outward[axis] > 0.0 ? -1.0 : 1.0;
    std::array<bool, 3> axes{};
    axes[index(axis)] = true;
    std::array<double, 2> felt_N{};
    for (CompositeGrid* const grid : {this, &wide}) {
      grid->begin(place);
      for (int c = 0; c < kPressedCycles; ++c) {
        grid->clear_pressed();
        grid->press(place, depth_m * normal, normal);
        grid->cycle(axes);
      }
      felt_N[grid == this ? 0 : 1] = glm::length(grid->force_on_tool_N());
    }
    if (!(std::fabs(felt_N[0] - felt_N[1]) < kMaxForceError * felt_N[1]))
      return "coarse levels know too little of its shape";
  }
  return {};
}

bool CompositeGrid::anchored_by_sides() const noexcept {
  const auto& dims = lattice_.grid().dims;
  for (RowId row = 0; row < lattice_.grid().rows(); ++row) {
    for (std::uint32_t lanes = lattice_.anchored_lanes(row); lanes != 0; lanes &= lanes - 1) {
      const Index3 at = lattice_.coordinates(row * kRow + static_cast<VoxelId>(std::countr_zero(lanes)));
      bool in_side = false;
      for (std::size_t d = 0; d < 3; ++d) {
        in_side = in_side || (at[d] == 0 && material_.anchored_share(d, 0) == 1.0) ||
                  (at[d] == dims[d] - 1 && material_.anchored_share(d, 1) == 1.0);
      }
      if (!in_side) return false;
    }
  }
  return true;
}

bool CompositeGrid::far_from_anchors(const Index3& voxel) const noexcept {
  return !material_.anchor_near(shifted(voxel), shifted(voxel), 2 * kFromAnchors);
}

}  // namespace voxel
