// SPDX-License-Identifier: GPL-3.0-or-later
// Which objects a composite grid is right for.
#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "voxel/composite/grid.h"
#include "voxel/lattice/link_stiffness.h"

namespace voxel {
namespace {

constexpr int kTried = 10;                            // half width of level 0 where an object is tried
constexpr double kConverges = 0.85;                   // of what is left of rest stays in a cycle
constexpr double kMostOff = 0.05;                     // of the force, where boxes twice as wide have it
constexpr int kFromAnchors = 16;                      // voxels
constexpr double kMostThin = 0.02;                    // of what links carry where tissues meet
constexpr double kLeastSeen = 0.8, kMostSeen = 1.25;  // of what anchors hold

std::size_t index(int i) {
  return static_cast<std::size_t>(i);
}

// Has every link a cell on some side? One in a sheet, or a row, of single voxels has none.
bool has_thin_parts(const Lattice& lattice) {
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

// Of what links carry where tissues meet, the share of those that are too thin to have a cell of their own
// stiffness (LinkParts::thin), which a grid made of cells does not know. Of kRowsTried rows at most.
double share_of_thin_tissue(const Lattice& lattice) {
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
  if (lattice.yields()) return "it keeps dents";
  if (lattice.has_bricks()) return "it is of the accurate energy";
  for (int d = 0; d < 3; ++d) {
    const LinkLimit& l = lattice.tightest(d);
    if (l.along_low >= 0.0F || l.along_high <= 0.0F || l.across <= 0.0F) return "its links have no slack";
  }
  if (has_thin_parts(lattice)) return "parts of it are one voxel thick";
  if (lattice.materials().size() > 2 && share_of_thin_tissue(lattice) > kMostThin)
    return "much of its stiffer tissue is one voxel thick";
  const CompositeGrid grid(lattice, kHalfWidth);
  // How far the chain lets tissue go beside other anchors, nothing tells a press.
  if (!grid.anchored_by_sides()) return "it is anchored otherwise than by whole sides";
  const double seen = grid.anchor_area_ratio();
  if (seen < kLeastSeen || seen > kMostSeen) return "coarse levels do not see what anchors hold";
  return CompositeGrid(lattice, kTried).wrong_somewhere();
}

// Asked of places all over the surface: from any state without a tool cycles come to rest, and a patch that
// is pressed feels what it does in boxes twice as wide. (Where a slot or an inclusion is as wide as the
// spacing of a level, what that is told to do may stretch links across it that it knows nothing of: such
// objects fail here.)
std::string CompositeGrid::wrong_somewhere() {
  constexpr std::size_t kPlaces = 12;
  constexpr int kCycles = 10, kFirst = 2, kPressedCycles = 24;
  constexpr double kDepth = 1.0;  // spacings
  CompositeGrid wide(lattice_, 2 * kTried, 2 * kHalfWidth);
  const auto surface = lattice_.surface();
  // From one node to the next, so that limits have no say.
  float least = std::numeric_limits<float>::max();
  for (const auto& d : limit_m_) {
    for (const auto& axis : d) least = std::min({least, axis[0], axis[1]});
  }
  const float most_m = 0.5F * least;
  // Of several tissues they are held link by link, which in a patch may take a hundred cycles, and says
  // nothing of shape.
  const double depth_m = cells_.several() ? most_m : kDepth * lattice_.min_spacing_m();
  for (std::size_t n = 0; n < kPlaces; ++n) {
    const VoxelId v = surface[(2 * n + 1) * surface.size() / (2 * kPlaces)];
    const Index3 place = lattice_.coordinates(v);
    if (lattice_.anchored(v)) continue;
    begin(place);
    std::uint32_t random = 1;
    for (Level& level : levels_) {
      for (std::size_t i = 0; i < level.inverse[0].size(); ++i) {
        for (std::size_t a = 0; a < 3; ++a) {
          random = random * 1664525U + 1013904223U;
          level.u[a][i] = level.inverse[a][i] > 0.0F
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
    if (!(std::fabs(felt_N[0] - felt_N[1]) < kMostOff * felt_N[1]))
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
        in_side = in_side || (at[d] == 0 && cells_.anchored_part(d, 0) == 1.0) ||
                  (at[d] == dims[d] - 1 && cells_.anchored_part(d, 1) == 1.0);
      }
      if (!in_side) return false;
    }
  }
  return true;
}

bool CompositeGrid::far_from_anchors(const Index3& voxel) const noexcept {
  return !cells_.anchor_near(shifted(voxel), shifted(voxel), 2 * kFromAnchors);
}

}  // namespace voxel
