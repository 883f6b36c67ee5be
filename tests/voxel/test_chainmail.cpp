// SPDX-License-Identifier: GPL-3.0-or-later
// ChainMail against its definition: per axis the new state is clamp(u, L, U), with L and U from shortest
// paths in the graph of the limits (voxel/chainmail.h). The reference finds those paths by Bellman and Ford,
// in double.
#include "voxel/chainmail.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <iostream>
#include <limits>
#include <utility>

#include "tests/voxel/lattice_scenes.h"

namespace {

using tests::block;
using tests::Random;
using tests::random_scene;
using tests::RandomScene;
using tests::voxel_at;
using tests::voxel_of;
using voxel::ChainMail;
using voxel::Displacement;
using voxel::Lattice;
using voxel::LatticeOptions;
using voxel::Obstacle;
using voxel::VoxelId;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kHalfUlp = 6e-8;  // 2^-24: one rounding of a float, relative

struct Source {
  VoxelId v;
  glm::vec3 place;  // displacement it is moved to
};

// Of the sources placed so far, per axis: the interval each voxel is left by them.
struct Interval {
  std::vector<double> low, high;
};

// Shrinks the interval by the paths from one source at displacement u: Bellman and Ford until nothing
// changes.
void constrain(const Lattice& lattice, int axis, VoxelId source, double u, Interval& interval) {
  auto& [low, high] = interval;
  low[source] = std::max(low[source], u);
  high[source] = std::min(high[source], u);
  for (bool changed = true; changed;) {
    changed = false;
    const auto tighten = [&](double& value, double wanted, bool up) {
      if (up ? wanted <= value : wanted >= value) return;
      value = wanted;
      changed = true;
    };
    for (std::size_t i = 0; i < lattice.size(); ++i) {
      const auto a = static_cast<VoxelId>(i);
      if (!lattice.filled(a)) continue;
      for (int d = 0; d < 3; ++d) {
        const VoxelId b = a + static_cast<VoxelId>(lattice.stride(d));
        if (!lattice.filled(b)) continue;
        const auto bounds = lattice.bounds(a, d, axis);  // of u(b) − u(a)
        const double lo = static_cast<double>(bounds[0]), hi = static_cast<double>(bounds[1]);
        tighten(low[b], low[a] + lo, true);
        tighten(low[a], low[b] - hi, true);
        tighten(high[b], high[a] + hi, false);
        tighten(high[a], high[b] - lo, false);
      }
    }
  }
}

using Intervals = std::array<Interval, 3>;

Intervals held_by_anchors(const Lattice& lattice) {
  Intervals result;
  for (int axis = 0; axis < 3; ++axis) {
    auto& interval = result[static_cast<std::size_t>(axis)];
    interval.low.assign(lattice.size(), -kInfinity);
    interval.high.assign(lattice.size(), kInfinity);
    for (std::size_t v = 0; v < lattice.size(); ++v) {
      if (lattice.anchored(static_cast<VoxelId>(v)))
        constrain(lattice, axis, static_cast<VoxelId>(v), 0.0, interval);
    }
  }
  return result;
}

// Up to `count` sources, each placed anywhere that anchors and those before it leave it, so that all are
// mutually feasible. `extreme`: at the very ends of that interval.
std::vector<Source> feasible_sources(const RandomScene& scene, const Lattice& lattice, Random& random,
                                     int count, bool extreme, Intervals& intervals) {
  std::vector<Source> sources;
  const double reach = 8.0 * lattice.max_spacing_m();
  for (int n = 0; n < count; ++n) {
    const VoxelId v =
        voxel_of(lattice, scene.volume,
                 scene.filled[static_cast<std::size_t>(random.below(static_cast<int>(scene.filled.size())))]);
    const bool again = std::any_of(sources.begin(), sources.end(), [v](const Source& s) { return s.v == v; });
    if (lattice.anchored(v) || again) continue;
    Source s{v, {}};
    for (int axis = 0; axis < 3; ++axis) {
      auto& interval = intervals[static_cast<std::size_t>(axis)];
      const double low = std::max(interval.low[v], -reach), high = std::min(interval.high[v], reach);
      const double part = extreme ? random.below(2) : random.unit();
      auto u = static_cast<float>(low + (high - low) * part);
      // What rounding to a float put outside is not feasible.
      if (static_cast<double>(u) > high) u = std::nextafter(u, -1e30F);
      if (static_cast<double>(u) < low) u = std::nextafter(u, 1e30F);
      s.place[axis] = u;
      constrain(lattice, axis, v, static_cast<double>(u), interval);
    }
    sources.push_back(s);
  }
  return sources;
}

double largest(const Displacement& state) {
  float most = 0.0F;
  for (const auto& axis : state.u) {
    for (const float u : axis) most = std::max(most, std::fabs(u));
  }
  return static_cast<double>(most);
}

// Moves the sources and settles the chain, as a contact does.
void pull(const Lattice& lattice, ChainMail& chain, Displacement& state, const std::vector<Source>& sources,
          std::span<const Obstacle> obstacles = {}, std::span<const std::uint32_t> surface_number = {}) {
  std::vector<VoxelId> voxels;
  std::vector<glm::vec3> moves;
  for (const Source& s : sources) {
    const glm::vec3 before(state.at(s.v));
    state.set(s.v, glm::dvec3(s.place));
    voxels.push_back(s.v);
    moves.push_back(s.place - before);
  }
  chain.settle(state, voxels, moves, obstacles, surface_number);
  for (std::size_t v = 0; v < lattice.size(); ++v) {
    if (!lattice.anchored(static_cast<VoxelId>(v))) continue;
    EXPECT_EQ(state.at(static_cast<VoxelId>(v)), glm::dvec3(0.0)) << "an anchor moved";
  }
}

// Rounding that a chain of additions along any path may gather.
double rounding(const RandomScene& scene, const Displacement& state) {
  const auto& dims = scene.volume.dims;
  return kHalfUlp * largest(state) * 2 * (dims[0] + dims[1] + dims[2]);
}

TEST(ChainMail, IsTheClampOfItsDefinition) {
  Random random(11);
  double worst = 0.0, worst_link = 0.0;
  std::size_t settles = 0, moved = 0, sources_in_all = 0, order_matters = 0;
  for (int n = 0; n < 500; ++n) {
    const RandomScene scene = random_scene(random, 1 + random.below(4));
    const Lattice lattice(scene.volume, scene.options);
    ChainMail chain(lattice);
    Displacement state(lattice);
    // From rest first, then from wherever the last pull left the chain: any feasible state is a start.
    for (int round = 0; round < 4; ++round) {
      const Displacement before = state;
      Intervals allowed = held_by_anchors(lattice);
      const bool extreme = random.below(4) == 0;
      auto sources = feasible_sources(scene, lattice, random, 1 + random.below(4), extreme, allowed);
      if (sources.empty()) continue;
      pull(lattice, chain, state, sources);
      const double tolerance = std::max(rounding(scene, state), rounding(scene, before));
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto& [low, high] = allowed[axis];
        for (std::size_t v = 0; v < lattice.size(); ++v) {
          if (!lattice.filled(static_cast<VoxelId>(v))) continue;
          const double expected = std::min(std::max(static_cast<double>(before.u[axis][v]), low[v]), high[v]);
          const double error = std::fabs(static_cast<double>(state.u[axis][v]) - expected);
          ASSERT_LE(error, tolerance) << "scene " << n << ", round " << round << ", axis " << axis;
          worst = std::max(worst, error / std::max(largest(state), 1e-30));
        }
      }
      const double link = voxel::worst_violation(lattice, state);
      ASSERT_LE(link, tolerance);
      worst_link = std::max(worst_link, link / std::max(largest(state), 1e-30));
      ++settles;
      moved += chain.moved().size();
      sources_in_all += sources.size();

      // The sources the other way round: not a bit changes. Only where sources are as far from one another as
      // the chain allows, up to rounding, may the one that is met first decide that rounding.
      Displacement again = before;
      std::reverse(sources.begin(), sources.end());
      pull(lattice, chain, again, sources);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        for (std::size_t v = 0; v < lattice.size(); ++v) {
          const double difference =
              std::fabs(static_cast<double>(again.u[axis][v]) - static_cast<double>(state.u[axis][v]));
          ASSERT_LE(difference, tolerance);
          if (difference == 0.0) continue;
          ++order_matters;
          ASSERT_TRUE(extreme);
        }
      }
    }
  }
  std::cout << settles << " settles of " << sources_in_all << " sources that moved " << moved
            << " voxels; largest error " << worst << ", largest violation " << worst_link
            << " of the largest displacement; the order of sources decided a rounding of " << order_matters
            << " voxels\n";
  EXPECT_GT(settles, 1500U);
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
        // Anywhere: beyond the chain, and against one another.
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
  // A column of nine links that may stretch by half: its free end follows by 4.5 spacings and no further.
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

// Scenes with half-spaces over surface voxels, which the voxels are clear of at rest.
struct ObstacleScene {
  std::vector<Obstacle> obstacles;
  std::vector<std::uint32_t> number;
};

ObstacleScene random_obstacles(const Lattice& lattice, Random& random, bool oblique, double share) {
  ObstacleScene result;
  result.obstacles.resize(lattice.surface().size());
  result.number.assign(lattice.size(), 0);
  for (std::size_t s = 0; s < lattice.surface().size(); ++s) {
    result.number[lattice.surface()[s]] = static_cast<std::uint32_t>(s);
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
  double worst_link = 0.0, worst_depth = 0.0;  // of the spacing
};

void push_into_obstacles(const RandomScene& scene, const Lattice& lattice, const ObstacleScene& in_the_way,
                         Random& random, Tally& tally) {
  ChainMail chain(lattice);
  Displacement state(lattice);
  for (const VoxelId v : lattice.surface()) {
    if (in_the_way.obstacles[in_the_way.number[v]].normal == glm::vec3(0.0F) || lattice.anchored(v)) continue;
    state.set_role(v, Displacement::obstacle, lattice);
  }
  Intervals allowed = held_by_anchors(lattice);
  const auto sources = feasible_sources(scene, lattice, random, 3, false, allowed);
  if (sources.empty()) return;
  pull(lattice, chain, state, sources, in_the_way.obstacles, in_the_way.number);
  const double h = lattice.max_spacing_m();
  double depth = 0.0;
  for (const VoxelId v : lattice.surface()) {
    if (state.role[v] != Displacement::obstacle) continue;
    const Obstacle& o = in_the_way.obstacles[in_the_way.number[v]];
    depth = std::max(depth, (static_cast<double>(o.bound) - glm::dot(glm::dvec3(o.normal), state.at(v))) / h);
  }
  ++tally.settles;
  tally.worst_link = std::max(tally.worst_link, voxel::worst_violation(lattice, state) / h);
  tally.worst_depth = std::max(tally.worst_depth, depth);
  if (depth > 1e-5) ++tally.deep_settles;
}

void tell(const char* what, const Tally& tally) {
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
  tell("along an axis", tally);
  EXPECT_LE(tally.worst_link, 1e-5);
  EXPECT_LE(tally.worst_depth, 2e-6);
}

TEST(ChainMail, NoObliqueSurfaceBreaksALink) {
  // The axes of the chain are independent, those of an oblique half-space are not: a voxel put back onto it
  // moves on all three, where an anchor may hold it. Then it stays in the surface, and relaxation takes it
  // out.
  Random random(14);
  Tally any, plane;
  for (int n = 0; n < 400; ++n) {
    const RandomScene scene = random_scene(random, 1 + random.below(4));
    const Lattice lattice(scene.volume, scene.options);
    push_into_obstacles(scene, lattice, random_obstacles(lattice, random, true, 0.3), random, any);
    // One plane beside the object, as a bone would be.
    ObstacleScene bone = random_obstacles(lattice, random, true, 0.0);
    const glm::vec3 normal(
        glm::normalize(glm::dvec3(random.between(-1, 1), random.between(-1, 1), random.between(-1, 1))));
    double lowest = kInfinity;
    const auto height = [&](VoxelId v) { return glm::dot(glm::dvec3(normal), lattice.rest(v)); };
    for (const VoxelId v : lattice.surface()) lowest = std::min(lowest, height(v));
    for (const VoxelId v : lattice.surface()) {
      bone.obstacles[bone.number[v]] = {normal, static_cast<float>(lowest - height(v))};
    }
    push_into_obstacles(scene, lattice, bone, random, plane);
  }
  tell("each voxel its own surface", any);
  tell("one plane", plane);
  EXPECT_LE(any.worst_link, 1e-5);
  EXPECT_LE(plane.worst_link, 1e-5);
}

TEST(ChainMail, ADeepPushMovesAnOctahedron) {
  // With the same slack along and across, what moves is everything nearer than depth / slack in steps of the
  // lattice: (2n+1)(2n²+2n+3)/3 voxels, so the cube of the depth.
  const double h = 1e-3;
  const LatticeOptions options = tests::made_of({.stretch_min = 0.5, .stretch_max = 1.5, .shear = 0.5}, "-x");
  const Lattice lattice(block({31, 31, 31}, glm::dvec3(h)), options);
  ChainMail chain(lattice);
  for (int n = 1; n <= 12; ++n) {
    Displacement state(lattice);
    pull(lattice, chain, state,
         {{voxel_at(lattice, 15, 15, 15), {0.0F, 0.0F, static_cast<float>(0.5 * h * (n + 0.5))}}});
    const auto octahedron = static_cast<std::size_t>((2 * n + 1) * (2 * n * n + 2 * n + 3) / 3);
    EXPECT_EQ(chain.moved().size(), octahedron);
    std::vector<VoxelId> once(chain.moved().begin(), chain.moved().end());
    std::sort(once.begin(), once.end());
    EXPECT_EQ(std::adjacent_find(once.begin(), once.end()), once.end());
    // In a homogeneous block each voxel is reached by a shortest path at once and asks its six neighbours
    // once.
    EXPECT_LE(chain.candidates(), 6 * octahedron + 6);
  }
  // All three axes at once move the union of three octahedra: the same one.
  Displacement state(lattice);
  pull(lattice, chain, state,
       {{voxel_at(lattice, 15, 15, 15), glm::vec3(static_cast<float>(0.5 * h * 4.5))}});
  EXPECT_EQ(chain.moved().size(), 129U);
}

}  // namespace
