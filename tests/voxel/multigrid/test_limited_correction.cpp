// SPDX-License-Identifier: GPL-3.0-or-later
// Corrections of many rows, clipped by the links' limits, against their definition.
#include "voxel/multigrid/limited_correction.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/voxel/fixtures/chain_reference.h"
#include "voxel/multigrid/fas.h"

namespace {

using tests::Random;
using voxel::Displacement;
using voxel::kRow;
using voxel::Lattice;
using voxel::RowId;
using voxel::VoxelId;

// A lattice whose state was pulled. Many of its links are at their limits, and none is beyond them.
struct Pulled {
  tests::RandomScene scene;
  Lattice lattice;
  Displacement state;

  explicit Pulled(Random& random)
      : scene(tests::random_scene(random)), lattice(scene.volume, scene.options), state(pulled(random)) {}

  Displacement pulled(Random& random) const {
    Displacement to(lattice);
    voxel::ChainMail chain(lattice);
    tests::Intervals allowed = tests::held_by_anchors(lattice);
    const auto sources =
        tests::feasible_sources(scene, lattice, random, 1 + random.below(6), random.below(2) != 0, allowed);
    tests::pull(lattice, chain, to, sources);
    return to;
  }
};

// Whether the voxel is not anchored and has a link.
bool moves(const Lattice& lattice, VoxelId v) {
  if (!lattice.filled(v) || lattice.anchored(v)) return false;
  for (int d = 0; d < 3; ++d) {
    if (lattice.filled(lattice.up(v, d)) || lattice.filled(lattice.down(v, d))) return true;
  }
  return false;
}

using Ways = std::vector<std::array<float, 3>>;  // [v][axis]

void move(const Lattice& lattice, Displacement& state, const Ways& ways) {
  voxel::Multigrid multigrid(lattice);
  for (RowId row = 0; row < lattice.grid().rows(); ++row) {
    if (!multigrid.can_batch(row, state)) continue;
    multigrid.batch(row, state, [&](voxel::RowVector& way) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        for (std::size_t i = 0; i < kRow; ++i) way[axis][i] = ways[row * kRow + i][axis];
      }
    });
  }
  multigrid.move_batch(state);
  multigrid.clear_batch();
}

Ways random_ways(const Lattice& lattice, Random& random, double sign) {
  Ways ways(lattice.size());
  const double most = random.between(0.1, 4.0) * lattice.max_spacing_m();
  for (auto& way : ways) {
    for (float& w : way)
      w = static_cast<float>(most * (sign == 0.0 ? random.between(-1.0, 1.0) : sign * random.unit()));
  }
  return ways;
}

double tolerance(const Pulled& p, const Displacement& before) {
  return 8.0 * std::max(tests::rounding(p.scene, p.state), tests::rounding(p.scene, before));
}

TEST(LimitedCorrection, LeavesNoLinkBeyondItsLimitsAndGoesNoFurtherThanAsked) {
  Random random(1);
  for (int n = 0; n < tests::scenes(200); ++n) {
    Pulled p(random);
    const Displacement before = p.state;
    const Ways ways = random_ways(p.lattice, random, 0.0);
    move(p.lattice, p.state, ways);
    ASSERT_LE(voxel::worst_violation(p.lattice, p.state), tolerance(p, before)) << "scene " << n;
    for (std::size_t v = 0; v < p.lattice.size(); ++v) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const float from = before.u[axis][v], to = from + ways[v][axis], is = p.state.u[axis][v];
        const bool may = moves(p.lattice, static_cast<VoxelId>(v));
        ASSERT_GE(is, std::min(from, may ? to : from)) << "scene " << n;
        ASSERT_LE(is, std::max(from, may ? to : from)) << "scene " << n;
      }
    }
  }
}

TEST(LimitedCorrection, WhereAllGoTheSameWayTheLeastThatMustComesBack) {
  Random random(2);
  double worst = 0.0;
  for (int n = 0; n < tests::scenes(200); ++n) {
    Pulled p(random);
    const Displacement before = p.state;
    const Ways ways = random_ways(p.lattice, random, -1.0);
    move(p.lattice, p.state, ways);
    for (int axis = 0; axis < 3; ++axis) {
      const auto ua = static_cast<std::size_t>(axis);
      std::vector<double> least(p.lattice.size());
      for (std::size_t v = 0; v < least.size(); ++v) {
        const bool may = moves(p.lattice, static_cast<VoxelId>(v));
        least[v] = static_cast<double>(before.u[ua][v] + (may ? ways[v][ua] : 0.0F));
      }
      const auto arcs = tests::arcs_of(p.lattice, axis);
      for (bool changed = true; changed;) {
        changed = false;
        const auto raise = [&](VoxelId v, double to) {
          if (to <= least[v]) return;
          least[v] = to;
          changed = true;
        };
        for (const tests::Arc& arc : arcs) {
          raise(arc.to, least[arc.from] + arc.low);
          raise(arc.from, least[arc.to] - arc.high);
        }
      }
      for (std::size_t v = 0; v < least.size(); ++v) {
        if (!p.lattice.filled(static_cast<VoxelId>(v))) continue;
        const double error = std::fabs(static_cast<double>(p.state.u[ua][v]) - least[v]);
        ASSERT_LE(error, tolerance(p, before)) << "scene " << n;
        worst = std::max(worst, error / tests::largest(before));
      }
    }
  }
  RecordProperty("worst", std::to_string(worst));
}

TEST(LimitedCorrection, ArrivesWhereItWasAskedToWhereLinksAllowThat) {
  Random random(3);
  for (int n = 0; n < tests::scenes(200); ++n) {
    Pulled p(random);
    const Displacement before = p.state, target = p.pulled(random);
    Ways ways(p.lattice.size());
    for (std::size_t v = 0; v < ways.size(); ++v) {
      for (std::size_t axis = 0; axis < 3; ++axis) ways[v][axis] = target.u[axis][v] - before.u[axis][v];
    }
    move(p.lattice, p.state, ways);
    for (std::size_t v = 0; v < p.lattice.size(); ++v) {
      if (!moves(p.lattice, static_cast<VoxelId>(v))) continue;
      for (std::size_t axis = 0; axis < 3; ++axis)
        ASSERT_NEAR(p.state.u[axis][v], target.u[axis][v], tolerance(p, before)) << "scene " << n;
    }
  }
}

}  // namespace
