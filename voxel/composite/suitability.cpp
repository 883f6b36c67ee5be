// SPDX-License-Identifier: GPL-3.0-or-later
// Decides which objects can be solved on a CompositeGrid: by their materials and anchors, and by trial
// contacts.
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <iterator>
#include <limits>

#include "voxel/composite/grid.h"

namespace voxel {
namespace {

using composite::index;

constexpr int kTrialHalfWidth = 10;  // of level 0 in trials
constexpr double kConverges = 0.85;  // largest accepted mean convergence factor of displacements per cycle
// Largest accepted error, as a share of the force with patches twice as wide: two just noticeable
// differences of 7 %. This library must not include hybrid/feel/just_noticeable.h, which has the same
// figures.
constexpr double kMaxForceError = 0.14;
// Forces are scaled to a press as deep as this share of the object's smallest side. Errors are relative to
// the force, or to 0.57 N if the force is smaller: 7 % of 0.57 N is 0.04 N, which a hand does not feel.
constexpr double kPressedShare = 0.1, kLeastForce_N = 0.57;

bool one_voxel_thick(const Lattice& lattice, VoxelId v) {
  const auto alone_along = [&](int d) {
    return !lattice.filled(lattice.up(v, d)) && !lattice.filled(lattice.down(v, d));
  };
  return alone_along(0) || alone_along(1) || alone_along(2);
}

// Voxels for trials: at most kPlaces of the surface, and as many of the parts that are one voxel thick in
// air, which coarse levels resolve least. Both samples are evenly spaced in the order of voxels.
std::vector<VoxelId> trial_places(const Lattice& lattice) {
  constexpr std::size_t kPlaces = 12;
  const auto surface = lattice.surface();
  std::vector<VoxelId> thin, places;
  std::copy_if(surface.begin(), surface.end(), std::back_inserter(thin),
               [&](VoxelId v) { return one_voxel_thick(lattice, v); });
  for (const auto& voxels : {surface, std::span<const VoxelId>(thin)}) {
    for (std::size_t n = 0; n < kPlaces && !voxels.empty(); ++n)
      places.push_back(voxels[(2 * n + 1) * voxels.size() / (2 * kPlaces)]);
  }
  return places;
}

// The axis direction nearest to the inward normal. For a sheet one voxel thick, which has no such normal: the
// direction across the sheet.
glm::dvec3 direction_into(const Lattice& lattice, VoxelId v) {
  const glm::dvec3 outward = lattice.outward(v);
  int axis = CompositeGrid::largest_axis(outward);
  for (int d = 0; outward == glm::dvec3(0.0) && d < 3; ++d) {
    if (!lattice.filled(lattice.up(v, d)) || !lattice.filled(lattice.down(v, d))) axis = d;
  }
  glm::dvec3 into(0.0);
  into[axis] = outward[axis] > 0.0 ? -1.0 : 1.0;
  return into;
}

bool alike_in_poisson(std::span<const LinkMaterial> materials) {
  return std::all_of(materials.begin(), materials.end(),
                     [&](const LinkMaterial& m) { return m.poisson == materials.front().poisson; });
}

bool all_bricks(std::span<const LinkMaterial> materials) {
  return std::all_of(materials.begin(), materials.end(), [](const LinkMaterial& m) { return m.bricks; });
}

}  // namespace

CompositeGrid::Suitability CompositeGrid::suitability(const Lattice& lattice) {
  if (!alike_in_poisson(lattice.materials().subspan(1))) return {"its materials differ in Poisson's ratio"};
  if (lattice.has_plasticity()) return {"it keeps dents"};
  if (lattice.has_bricks() && !all_bricks(lattice.materials().subspan(1)))
    return {"only some of its materials have the accurate energy"};
  for (int d = 0; d < 3; ++d) {
    const LinkLimit& l = lattice.tightest(d);
    if (l.along_low >= 0.0F || l.along_high <= 0.0F || l.across <= 0.0F) return {"its links have no slack"};
  }
  return CompositeGrid(lattice, kTrialHalfWidth).try_contacts();
}

// Trials at places all over the surface. Cycles must converge to rest. The force on a pressed voxel must
// equal that on patches twice as wide, within kMaxForceError.
CompositeGrid::Suitability CompositeGrid::try_contacts() {
  CompositeGrid wide(lattice_, 2 * kTrialHalfWidth, 2 * kHalfWidth);
  // Differences between neighbours stay below every limit, so that limits play no part.
  float least = std::numeric_limits<float>::max();
  for (const auto& d : limit_m_) {
    for (const auto& axis : d) least = std::min({least, axis[0].tightest, axis[1].tightest});
  }
  const float most_m = 0.5F * least;
  const auto depth_m = static_cast<double>(most_m);
  double side_m = std::numeric_limits<double>::max();
  for (int d = 0; d < 3; ++d)
    side_m = std::min(side_m, lattice_.grid().dims[index(d)] * lattice_.spacing_m()[d]);
  const double scale = std::max(kPressedShare * side_m / depth_m, 1.0);
  Suitability result;
  for (const VoxelId v : trial_places(lattice_)) {
    const Index3 place = lattice_.coordinates(v);
    if (lattice_.anchored(v)) continue;
    if (!converges_at(place, most_m)) return {"coarse levels do not come to rest"};
    const glm::dvec3 push_m = depth_m * direction_into(lattice_, v);
    const double felt_N = scale * settled_press(place, push_m),
                 wide_N = scale * wide.settled_press(place, push_m);
    result.force_error =
        std::max(result.force_error, std::fabs(felt_N - wide_N) / std::max(wide_N, kLeastForce_N));
  }
  if (result.force_error > kMaxForceError) {
    result.reason = "coarse levels know too little of its shape: in trials, forces were " +
                    std::to_string(std::lround(100.0 * result.force_error)) + " % off those on wider patches";
  }
  return result;
}

// Do cycles without a tool come to rest fast enough? They start from a random state in which neighbours
// differ by at most `most_m`. The first kFirst of kCycles cycles do not count: smoothing removes most of the
// random state at once.
bool CompositeGrid::converges_at(const Index3& place, float most_m) noexcept {
  constexpr int kFirst = 3, kCycles = 10;
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
  for (int c = 0; c < kFirst; ++c) cycle();
  const double before = energy_J();
  for (int c = kFirst; c < kCycles; ++c) cycle();
  return energy_J() < std::pow(kConverges, 2 * (kCycles - kFirst)) * before;
}

// The steady force (N) on a voxel that is pushed along one axis from rest.
double CompositeGrid::settled_press(const Index3& place, const glm::dvec3& push_m) noexcept {
  constexpr int kRounds = 20, kCyclesOfRound = 10;  // rounds at most, and cycles of each
  constexpr double kSettled = 1e-3;                 // change in a round, as a share of the force
  std::array<bool, 3> axes{};
  axes[index(largest_axis(push_m))] = true;
  if (has_bricks_) axes.fill(true);
  begin(place);
  double felt_N = 0.0;
  for (int round = 0; round < kRounds; ++round) {
    const double before_N = felt_N;
    for (int c = 0; c < kCyclesOfRound; ++c) {
      clear_pressed();
      press(place, push_m, glm::normalize(push_m));
      cycle(axes);
    }
    felt_N = glm::length(force_on_tool_N());
    if (std::fabs(felt_N - before_N) <= kSettled * felt_N) break;
  }
  return felt_N;
}

}  // namespace voxel
