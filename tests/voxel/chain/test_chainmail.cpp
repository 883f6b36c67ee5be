// SPDX-License-Identifier: GPL-3.0-or-later
// ChainMail against its definition: on each axis the new state is clamp(u, L, U). L and U come from shortest
// paths in the graph of the limits (voxel/chain/chainmail.h).
#include "voxel/chain/chainmail.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <iostream>
#include <vector>

#include "tests/voxel/fixtures/chain_reference.h"
#include "tests/voxel/fixtures/lattice_scenes.h"
#include "voxel/object/validate.h"

namespace {

using namespace tests;
using voxel::LatticeOptions;
using voxel::RowId;

TEST(ChainMail, IsTheClampOfItsDefinition) {
  Random random(11);
  double worst = 0.0, worst_link = 0.0;
  std::size_t settles = 0, moved = 0, sources_in_all = 0;
  for (int n = 0; n < scenes(1000); ++n) {
    const RandomScene scene = random_scene(random, 1 + random.below(4));
    const Lattice lattice(scene.volume, scene.options);
    ChainMail chain(lattice);
    Displacement state(lattice);
    // The first round starts from rest, and each later one from the state that the round before left. Any
    // feasible state may be the start.
    for (int round = 0; round < 4; ++round) {
      const Displacement before = state;
      Intervals allowed = held_by_anchors(lattice);
      const bool extreme = random.below(4) == 0;
      auto sources = feasible_sources(scene, lattice, random, 1 + random.below(4), extreme, allowed);
      if (sources.empty()) continue;
      pull(lattice, chain, state, sources);
      const double tolerance = std::max(rounding(scene, state), rounding(scene, before));
      const double error = error_of_clamp(lattice, before, state, allowed);
      ASSERT_LE(error, tolerance) << "scene " << n << ", round " << round;
      worst = std::max(worst, error / std::max(largest(state), 1e-30));
      const double link = voxel::worst_violation(lattice, state);
      ASSERT_LE(link, tolerance);
      worst_link = std::max(worst_link, link / std::max(largest(state), 1e-30));
      ++settles;
      moved += chain.moved_count();
      sources_in_all += sources.size();

      // With the sources in reverse order no bit of the result changes, even where their paths are equally
      // long.
      Displacement again = before;
      std::reverse(sources.begin(), sources.end());
      pull(lattice, chain, again, sources);
      ASSERT_EQ(differing_bits(lattice, again, state), 0U) << "scene " << n << ", round " << round;
    }
    EXPECT_EQ(voxel::validate(lattice), "") << "scene " << n;
    const double path = 2.0 * (scene.volume.dims[0] + scene.volume.dims[1] + scene.volume.dims[2]);
    EXPECT_EQ(voxel::validate(lattice, state, path), "") << "scene " << n;
  }
  std::cout << settles << " settles of " << sources_in_all << " sources that moved " << moved
            << " voxels; largest error " << worst << ", largest violation " << worst_link
            << " of the largest displacement\n";
  EXPECT_GT(settles, 3U * scenes(1000));
}

TEST(ChainMail, WhatCannotBeReachedGivesWayToAnchors) {
  Random random(12);
  double worst = 0.0;
  for (int n = 0; n < 500; ++n) {
    const RandomScene scene = random_scene(random, 1 + random.below(4));
    const Lattice lattice(scene.volume, scene.options);
    ChainMail chain(lattice);
    Displacement state(lattice);
    for (int round = 0; round < 4; ++round) {
      std::vector<Source> sources;
      Intervals ignored = held_by_anchors(lattice);
      for (const Source& s : feasible_sources(scene, lattice, random, 4, false, ignored)) {
        // The source may be anywhere, even beyond the end of the chain or incompatible with the other
        // sources.
        glm::vec3 place;
        for (int a = 0; a < 3; ++a) {
          place[a] = static_cast<float>(random.between(-30, 30) * lattice.max_spacing_m());
        }
        sources.push_back({s.v, place});
      }
      if (sources.empty()) continue;
      float asked = 0.0F;
      for (const Source& s : sources) {
        for (int a = 0; a < 3; ++a) asked = std::max(asked, std::fabs(s.place[a]));
      }
      pull(lattice, chain, state, sources);
      const auto& dims = scene.volume.dims;
      const double link = voxel::worst_violation(lattice, state) / static_cast<double>(asked);
      worst = std::max(worst, link);
      ASSERT_LE(link, kHalfUlp * 2 * (dims[0] + dims[1] + dims[2])) << "scene " << n << ", round " << round;
    }
  }
  std::cout << "largest violation " << worst << " of what was asked for\n";
}

TEST(ChainMail, ASourceThatPullsTooFarEndsWhereTheChainEnds) {
  // Ten voxels in a column along z, hence nine links. Voxel 0 is anchored. Each link may stretch by half a
  // spacing. So the voxel at the other end can move by 9 · 0.5 = 4.5 spacings at most, wherever it is pulled.
  const double h = 1e-3;
  LatticeOptions options = tests::made_of({.stretch_min = 0.5, .stretch_max = 1.5, .shear = 0.25});
  const Lattice lattice(block({1, 1, 10}, glm::dvec3(h)), options);
  ChainMail chain(lattice);
  Displacement state(lattice);
  const VoxelId top = voxel_at(lattice, 0, 0, 9);
  pull(lattice, chain, state, {{top, {0.1F, 0.0F, 0.1F}}});
  for (int k = 0; k < 10; ++k) {
    const glm::dvec3 u = state.at(voxel_at(lattice, 0, 0, k));
    EXPECT_NEAR(u.x, 0.25 * k * h, 1e-6 * h);
    EXPECT_NEAR(u.z, 0.5 * k * h, 1e-6 * h);
    EXPECT_EQ(u.y, 0.0);
  }
}

// Half-spaces as obstacles of surface voxels. At rest the voxels do not touch their half-spaces.
struct ObstacleScene {
  std::vector<Obstacle> obstacles;
};

ObstacleScene random_obstacles(const Lattice& lattice, Random& random, bool oblique, double share) {
  ObstacleScene result;
  result.obstacles.resize(lattice.surface().size());
  for (std::size_t s = 0; s < lattice.surface().size(); ++s) {
    if (random.unit() > share) continue;
    glm::dvec3 n(0.0);
    if (oblique) {
      n = glm::normalize(glm::dvec3(random.between(-1, 1), random.between(-1, 1), random.between(-1, 1)));
    } else {
      n[random.below(3)] = random.below(2) != 0 ? 1.0 : -1.0;
    }
    result.obstacles[s] = {glm::vec3(n),
                           static_cast<float>(-random.between(0.0, 1.0) * lattice.max_spacing_m())};
  }
  return result;
}

struct Tally {
  std::size_t settles = 0, deep_settles = 0;
  double worst_link = 0.0, worst_depth = 0.0;  // in spacings
};

void push_into_obstacles(const RandomScene& scene, const Lattice& lattice, const ObstacleScene& in_the_way,
                         Random& random, Tally& tally) {
  ChainMail chain(lattice);
  Displacement state(lattice);
  for (const VoxelId v : lattice.surface()) {
    if (in_the_way.obstacles[lattice.surface_number(v)].normal == glm::vec3(0.0F) || lattice.anchored(v))
      continue;
    state.set_role(v, Displacement::obstacle);
  }
  Intervals allowed = held_by_anchors(lattice);
  const auto sources = feasible_sources(scene, lattice, random, 3, false, allowed);
  if (sources.empty()) return;
  pull(lattice, chain, state, sources, in_the_way.obstacles);
  const double h = lattice.max_spacing_m();
  double depth = 0.0;
  for (const VoxelId v : lattice.surface()) {
    if (state.role[v] != Displacement::obstacle) continue;
    const Obstacle& o = in_the_way.obstacles[lattice.surface_number(v)];
    depth = std::max(depth, (static_cast<double>(o.bound) - glm::dot(glm::dvec3(o.normal), state.at(v))) / h);
  }
  ++tally.settles;
  tally.worst_link = std::max(tally.worst_link, voxel::worst_violation(lattice, state) / h);
  tally.worst_depth = std::max(tally.worst_depth, depth);
  if (depth > 1e-5) ++tally.deep_settles;
}

void print_tally(const char* what, const Tally& tally) {
  std::cout << what << ": " << tally.settles << " settles; " << tally.deep_settles
            << " leave a voxel in its surface, the deepest by " << tally.worst_depth
            << " spacings; largest violation " << tally.worst_link << " spacings\n";
}

TEST(ChainMail, WhatIsPushedIntoASurfaceAlongAnAxisIsStoppedThere) {
  Random random(13);
  Tally tally;
  for (int n = 0; n < 400; ++n) {
    const RandomScene scene = random_scene(random, 1 + random.below(4));
    const Lattice lattice(scene.volume, scene.options);
    push_into_obstacles(scene, lattice, random_obstacles(lattice, random, false, 0.3), random, tally);
  }
  print_tally("along an axis", tally);
  EXPECT_LE(tally.worst_link, 1e-5);
  EXPECT_LE(tally.worst_depth, 2e-6);
}

TEST(ChainMail, NoObliqueSurfaceBreaksALink) {
  // The chain treats the axes independently. A voxel that is put back onto an oblique half-space moves on all
  // three axes. An anchor may prevent the move on one axis. Then the voxel stays in the obstacle until it is
  // relaxed.
  Random random(14);
  Tally any, plane;
  for (int n = 0; n < 400; ++n) {
    const RandomScene scene = random_scene(random, 1 + random.below(4));
    const Lattice lattice(scene.volume, scene.options);
    push_into_obstacles(scene, lattice, random_obstacles(lattice, random, true, 0.3), random, any);
    // One plane lies beside the object, like the surface of a bone.
    ObstacleScene bone = random_obstacles(lattice, random, true, 0.0);
    const glm::vec3 normal(
        glm::normalize(glm::dvec3(random.between(-1, 1), random.between(-1, 1), random.between(-1, 1))));
    double lowest = kInfinity;
    const auto height = [&](VoxelId v) { return glm::dot(glm::dvec3(normal), lattice.rest(v)); };
    for (const VoxelId v : lattice.surface()) lowest = std::min(lowest, height(v));
    for (const VoxelId v : lattice.surface()) {
      bone.obstacles[lattice.surface_number(v)] = {normal, static_cast<float>(lowest - height(v))};
    }
    push_into_obstacles(scene, lattice, bone, random, plane);
  }
  print_tally("each voxel its own surface", any);
  print_tally("one plane", plane);
  EXPECT_LE(any.worst_link, 1e-5);
  EXPECT_LE(plane.worst_link, 1e-5);
}

TEST(ChainMail, ADeepPushMovesAnOctahedron) {
  // With equal slack along and across links, all voxels nearer than depth / slack (in steps of the lattice)
  // move: (2n+1)(2n²+2n+3)/3 voxels, which grows with the cube of the depth.
  const double h = 1e-3;
  const LatticeOptions options = tests::made_of({.stretch_min = 0.5, .stretch_max = 1.5, .shear = 0.5}, "-x");
  const Lattice lattice(block({31, 31, 31}, glm::dvec3(h)), options);
  ChainMail chain(lattice);
  for (int n = 1; n <= 12; ++n) {
    Displacement state(lattice);
    pull(lattice, chain, state,
         {{voxel_at(lattice, 15, 15, 15), {0.0F, 0.0F, static_cast<float>(0.5 * h * (n + 0.5))}}});
    const auto octahedron = static_cast<std::size_t>((2 * n + 1) * (2 * n * n + 2 * n + 3) / 3);
    EXPECT_EQ(moved_voxels(lattice, state), octahedron);
    std::vector<RowId> once(chain.moved_rows().begin(), chain.moved_rows().end());
    std::sort(once.begin(), once.end());
    EXPECT_EQ(std::adjacent_find(once.begin(), once.end()), once.end());
    // The moved rows run along x, one for each y and z of the octahedron.
    EXPECT_EQ(once.size(), 2U * n * n + 2U * n + 1U);
    EXPECT_EQ(chain.moved_count(), 31 * once.size());
    EXPECT_LE(chain.work(), once.size());
  }
  // A move along all three axes moves the union of three octahedra, which are equal.
  Displacement state(lattice);
  pull(lattice, chain, state,
       {{voxel_at(lattice, 15, 15, 15), glm::vec3(static_cast<float>(0.5 * h * 4.5))}});
  EXPECT_EQ(moved_voxels(lattice, state), 129U);
}

}  // namespace
