// SPDX-License-Identifier: GPL-3.0-or-later
// ChainMail against its definition: per axis the new state is clamp(u, L, U), with L and U from shortest
// paths in the graph of the limits (voxel/chainmail.h). The reference finds those paths by Bellman and Ford,
// in double.
#include "voxel/sparse/chainmail.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <glm/geometric.hpp>
#include <iostream>
#include <limits>
#include <unordered_set>
#include <utility>

#include "tests/voxel/sparse/lattice_scenes.h"
#include "voxel/sparse/links.h"

namespace {

using tests::block;
using tests::Random;
using tests::random_scene;
using tests::RandomScene;
using tests::voxel_at;
using tests::voxel_of;
using voxel::sparse::ChainMail;
using voxel::sparse::Displacement;
using voxel::sparse::Lattice;
using voxel::sparse::LatticeOptions;
using voxel::sparse::Obstacle;
using voxel::sparse::RowId;
using voxel::sparse::VoxelId;

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

struct Arc {
  VoxelId from, to;
  double low, high;  // of u(to) − u(from)
};

std::vector<Arc> arcs_of(const Lattice& lattice, int axis) {
  std::vector<Arc> arcs;
  for (std::size_t i = 0; i < lattice.size(); ++i) {
    const auto a = static_cast<VoxelId>(i);
    if (!lattice.filled(a)) continue;
    for (int d = 0; d < 3; ++d) {
      const VoxelId b = lattice.up(a, d);
      if (!lattice.filled(b)) continue;
      const auto bounds = lattice.bounds(a, d, axis);
      arcs.push_back({a, b, static_cast<double>(bounds[0]), static_cast<double>(bounds[1])});
    }
  }
  return arcs;
}

// Shrinks the interval by the paths from one source at displacement u: Bellman and Ford until nothing
// changes.
void constrain(const Lattice& lattice, int axis, VoxelId source, double u, Interval& interval) {
  auto& [low, high] = interval;
  low[source] = std::max(low[source], u);
  high[source] = std::min(high[source], u);
  const std::vector<Arc> arcs = arcs_of(lattice, axis);
  for (bool changed = true; changed;) {
    changed = false;
    const auto tighten = [&](double& value, double wanted, bool up) {
      if (up ? wanted <= value : wanted >= value) return;
      value = wanted;
      changed = true;
    };
    for (const Arc& arc : arcs) {
      tighten(low[arc.to], low[arc.from] + arc.low, true);
      tighten(low[arc.from], low[arc.to] - arc.high, true);
      tighten(high[arc.to], high[arc.from] + arc.high, false);
      tighten(high[arc.from], high[arc.to] - arc.low, false);
    }
  }
}

// More scenes than in an everyday run: HYBRID_CHAIN_SCENES of each kind.
int scenes(int everyday) {
  const char* const wanted = std::getenv("HYBRID_CHAIN_SCENES");  // NOLINT(concurrency-mt-unsafe)
  return wanted != nullptr ? std::atoi(wanted) : everyday;
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

// Values that differ in any bit.
std::size_t differing_bits(const Lattice& lattice, const Displacement& a, const Displacement& b) {
  std::size_t count = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t v = 0; v < lattice.size(); ++v) {
      if (std::bit_cast<std::uint32_t>(a.u[axis][v]) != std::bit_cast<std::uint32_t>(b.u[axis][v])) ++count;
    }
  }
  return count;
}

std::size_t moved_voxels(const Lattice& lattice, const Displacement& state) {
  std::size_t count = 0;
  for (std::size_t v = 0; v < lattice.size(); ++v) {
    if (state.at(static_cast<VoxelId>(v)) != glm::dvec3(0.0)) ++count;
  }
  return count;
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
          std::span<const Obstacle> obstacles = {}) {
  std::vector<VoxelId> voxels;
  std::vector<glm::vec3> moves;
  for (const Source& s : sources) {
    const glm::vec3 before(state.at(s.v));
    state.set(s.v, glm::dvec3(s.place));
    voxels.push_back(s.v);
    moves.push_back(s.place - before);
  }
  chain.settle(state, voxels, moves, obstacles);
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
  std::size_t settles = 0, moved = 0, sources_in_all = 0;
  for (int n = 0; n < scenes(1000); ++n) {
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
      const double most = std::max(largest(state), 1e-30);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto& [low, high] = allowed[axis];
        for (std::size_t v = 0; v < lattice.size(); ++v) {
          if (!lattice.filled(static_cast<VoxelId>(v))) continue;
          const double expected = std::min(std::max(static_cast<double>(before.u[axis][v]), low[v]), high[v]);
          const double error = std::fabs(static_cast<double>(state.u[axis][v]) - expected);
          ASSERT_LE(error, tolerance) << "scene " << n << ", round " << round << ", axis " << axis;
          worst = std::max(worst, error / most);
        }
      }
      const double link = voxel::sparse::worst_violation(lattice, state);
      ASSERT_LE(link, tolerance);
      worst_link = std::max(worst_link, link / std::max(largest(state), 1e-30));
      ++settles;
      moved += chain.moved_count();
      sources_in_all += sources.size();

      // The sources the other way round: not a bit changes, nor where their paths are equally long.
      Displacement again = before;
      std::reverse(sources.begin(), sources.end());
      pull(lattice, chain, again, sources);
      ASSERT_EQ(differing_bits(lattice, again, state), 0U) << "scene " << n << ", round " << round;
    }
  }
  std::cout << settles << " settles of " << sources_in_all << " sources that moved " << moved
            << " voxels; largest error " << worst << ", largest violation " << worst_link
            << " of the largest displacement\n";
  EXPECT_GT(settles, static_cast<std::size_t>(3 * scenes(1000)));
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
      const double link = voxel::sparse::worst_violation(lattice, state) / static_cast<double>(asked);
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
  double worst_link = 0.0, worst_depth = 0.0;  // of the spacing
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
  tally.worst_link = std::max(tally.worst_link, voxel::sparse::worst_violation(lattice, state) / h);
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
      bone.obstacles[lattice.surface_number(v)] = {normal, static_cast<float>(lowest - height(v))};
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
    EXPECT_EQ(moved_voxels(lattice, state), octahedron);
    std::vector<RowId> once(chain.moved_rows().begin(), chain.moved_rows().end());
    std::sort(once.begin(), once.end());
    EXPECT_EQ(std::adjacent_find(once.begin(), once.end()), once.end());
    // Rows along x, one for each y and z of the octahedron, and what it takes to see that the next do not
    // move.
    EXPECT_EQ(once.size(), static_cast<std::size_t>(2 * n * n + 2 * n + 1));
    EXPECT_EQ(chain.moved_count(), 31 * once.size());
    EXPECT_LE(chain.work(), once.size());
  }
  // All three axes at once move the union of three octahedra: the same one.
  Displacement state(lattice);
  pull(lattice, chain, state,
       {{voxel_at(lattice, 15, 15, 15), glm::vec3(static_cast<float>(0.5 * h * 4.5))}});
  EXPECT_EQ(moved_voxels(lattice, state), 129U);
}

// Blocks and balls of one material, larger than a row, pushed at their surface: cones in closed form, cut by
// faces, by anchors, and where the body is no box.
TEST(ChainMail, ConesAreTheClampToo) {
  Random random(15);
  double worst = 0.0;
  for (int n = 0; n < scenes(15); ++n) {
    RandomScene scene;
    scene.volume = block({20 + random.below(60), 5 + random.below(12), 5 + random.below(12)},
                         {random.between(0.5e-3, 2e-3), random.between(0.5e-3, 2e-3), 1e-3});
    auto& volume = scene.volume;
    if (n % 3 == 0) {  // a lens, or a slit in a block
      for (int k = 0; k < volume.dims[2]; ++k) {
        for (int j = 0; j < volume.dims[1]; ++j) {
          for (int i = 0; i < volume.dims[0]; ++i) {
            const glm::dvec3 to(2.0 * i / (volume.dims[0] - 1) - 1.0, 2.0 * j / (volume.dims[1] - 1) - 1.0,
                                1.0 * k / (volume.dims[2] - 1));
            if (glm::length(to) > 1.0) volume.labels[volume.index(i, j, k)] = 0;
          }
        }
      }
    } else if (n % 3 == 1) {
      const int i = 1 + random.below(volume.dims[0] - 2), until = random.below(volume.dims[1]);
      for (int k = 0; k < volume.dims[2]; ++k) {
        for (int j = 0; j < until; ++j) volume.labels[volume.index(i, j, k)] = 0;
      }
    }
    for (std::size_t v = 0; v < volume.labels.size(); ++v) {
      if (volume.labels[v] != 0) scene.filled.push_back(v);
    }
    scene.options = tests::made_of({.stretch_min = random.between(0.5, 0.9),
                                    .stretch_max = random.between(1.1, 1.8),
                                    .shear = random.between(0.1, 0.5)});
    const Lattice lattice(volume, scene.options);
    ChainMail chain(lattice);
    Displacement state(lattice);
    for (int round = 0; round < 4; ++round) {
      const Displacement before = state;
      Intervals allowed;
      for (auto& interval : allowed) {
        interval.low.assign(lattice.size(), -kInfinity);
        interval.high.assign(lattice.size(), kInfinity);
      }
      // All anchors at once: they are as many as the lower face has voxels.
      for (int axis = 0; axis < 3; ++axis) {
        auto& interval = allowed[static_cast<std::size_t>(axis)];
        VoxelId any = 0;
        for (std::size_t v = 0; v < lattice.size(); ++v) {
          if (!lattice.anchored(static_cast<VoxelId>(v))) continue;
          any = static_cast<VoxelId>(v);
          interval.low[v] = interval.high[v] = 0.0;
        }
        constrain(lattice, axis, any, 0.0, interval);
      }
      auto sources = feasible_sources(scene, lattice, random, 1 + random.below(3), false, allowed);
      pull(lattice, chain, state, sources);
      const double tolerance = std::max(rounding(scene, state), rounding(scene, before));
      const double most = std::max(largest(state), 1e-30);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto& [low, high] = allowed[axis];
        for (std::size_t v = 0; v < lattice.size(); ++v) {
          if (!lattice.filled(static_cast<VoxelId>(v))) continue;
          const double expected = std::min(std::max(static_cast<double>(before.u[axis][v]), low[v]), high[v]);
          const double error = std::fabs(static_cast<double>(state.u[axis][v]) - expected);
          ASSERT_LE(error, tolerance) << "scene " << n << ", round " << round << ", axis " << axis;
          worst = std::max(worst, error / most);
        }
      }
      Displacement again = before;
      std::reverse(sources.begin(), sources.end());
      pull(lattice, chain, again, sources);
      ASSERT_EQ(differing_bits(lattice, again, state), 0U) << "scene " << n << ", round " << round;
    }
  }
  std::cout << "largest error " << worst << " of the largest displacement\n";
}

TEST(ChainMail, RoundingDoesNotAddUpOverASession) {
  // Thousands of small strokes, forth and back, over tissue of one and of three materials.
  for (const int materials : {1, 3}) {
    Random random(16);
    auto volume = block({40, 12, 12}, glm::dvec3(1e-3));
    for (auto& label : volume.labels) label = static_cast<std::uint8_t>(1 + random.below(materials));
    LatticeOptions options = tests::made_of({.stretch_min = 0.9, .stretch_max = 1.1, .shear = 0.1});
    options.materials[2] = {.stretch_min = 0.85, .stretch_max = 1.13, .shear = 0.17};
    options.materials[3] = {.stretch_min = 0.8, .stretch_max = 1.2, .shear = 0.2};
    const Lattice lattice(volume, options);
    ChainMail chain(lattice);
    Displacement state(lattice);
    double early = 0.0, late = 0.0, most = 0.0;
    const int strokes = 10 * scenes(400);
    for (int n = 0; n < strokes; ++n) {
      std::vector<Source> sources;
      for (int s = 0; s < 1 + n % 6; ++s) {
        const VoxelId v = voxel_at(lattice, random.below(40), random.below(12), 8 + random.below(4));
        if (std::any_of(sources.begin(), sources.end(), [v](const Source& o) { return o.v == v; })) continue;
        const glm::dvec3 by(random.between(-1e-3, 1e-3), random.between(-1e-3, 1e-3),
                            random.between(-1e-3, 1e-3));
        sources.push_back({v, glm::vec3(state.at(v) + by)});
      }
      pull(lattice, chain, state, sources);
      if (n % 20 != 0) continue;
      most = std::max(most, largest(state));
      double& worst = n < strokes / 4 ? early : late;
      worst = std::max(worst, voxel::sparse::worst_violation(lattice, state));
    }
    std::cout << materials << " materials: " << strokes << " strokes, largest violation " << early / most
              << " of the largest displacement in the first quarter, " << late / most << " after\n";
    EXPECT_LE(early, 8 * kHalfUlp * most);
    EXPECT_LE(late, 8 * kHalfUlp * most);
  }
}

// Links beyond their limits by more than `tolerance` none of whose ends lies in a row that waits.
std::size_t unexplained(const std::array<std::vector<Arc>, 3>& arcs, const Displacement& state,
                        const ChainMail& chain, double tolerance) {
  const auto waiting = chain.waiting_rows();
  const std::unordered_set<RowId> rows(waiting.begin(), waiting.end());
  std::size_t count = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto& u = state.u[static_cast<std::size_t>(axis)];
    for (const Arc& arc : arcs[static_cast<std::size_t>(axis)]) {
      const double apart = static_cast<double>(u[arc.to]) - static_cast<double>(u[arc.from]);
      if (apart >= arc.low - tolerance && apart <= arc.high + tolerance) continue;
      count +=
          rows.count(arc.from / voxel::sparse::kRow) + rows.count(arc.to / voxel::sparse::kRow) == 0 ? 1 : 0;
    }
  }
  return count;
}

TEST(ChainMail, WhatIsBeyondABudgetWaitsAndIsFinished) {
  Random random(17);
  std::size_t partial = 0, calls = 0;
  for (int n = 0; n < scenes(40); ++n) {
    auto volume =
        block({40 + random.below(30), 10 + random.below(20), 10 + random.below(20)}, glm::dvec3(1e-3));
    const int materials = 1 + 2 * random.below(2);
    for (auto& label : volume.labels) label = static_cast<std::uint8_t>(1 + random.below(materials));
    LatticeOptions options = tests::made_of({.stretch_min = 0.9, .stretch_max = 1.1, .shear = 0.1});
    options.materials[2] = {.stretch_min = 0.85, .stretch_max = 1.13, .shear = 0.17};
    const Lattice lattice(volume, options);
    const std::array arcs{arcs_of(lattice, 0), arcs_of(lattice, 1), arcs_of(lattice, 2)};
    ChainMail chain(lattice), whole(lattice);
    Displacement state(lattice), reference(lattice);
    const int nx = volume.dims[0], ny = volume.dims[1], nz = volume.dims[2];
    const double far = 0.1e-3 * (nz - 1);  // no anchor holds it back
    double asked = 0.0;
    for (int round = 0; round < 4; ++round) {
      const VoxelId v = voxel_at(lattice, random.below(nx), random.below(ny), nz - 1);
      glm::vec3 place(0.0F);
      for (int a = 0; a < 3; ++a) place[a] = static_cast<float>(random.between(-far, far));
      asked = std::max(asked, largest(state));
      for (int a = 0; a < 3; ++a) asked = std::max(asked, std::fabs(static_cast<double>(place[a])));
      const double tolerance = 16 * kHalfUlp * asked;
      const auto move_to = [&](ChainMail& with, Displacement& of, std::uint64_t budget) {
        const glm::vec3 move = place - glm::vec3(of.at(v));
        of.set(v, glm::dvec3(place));
        with.settle(of, {&v, 1}, {&move, 1}, {}, budget);
      };
      move_to(chain, state, 100);
      ++calls;
      partial += chain.waiting_rows().empty() ? 0 : 1;
      ASSERT_EQ(unexplained(arcs, state, chain, tolerance), 0U) << "scene " << n << ", round " << round;
      if (round == 0) {
        // The contact is where it was put, and its own links hold, whatever else waits.
        EXPECT_EQ(state.at(v), glm::dvec3(place));
        for (int axis = 0; axis < 3; ++axis) {
          const auto interval = voxel::sparse::link_interval(lattice, state, v, axis);
          EXPECT_GE(place[axis], interval[0] - static_cast<float>(tolerance));
          EXPECT_LE(place[axis], interval[1] + static_cast<float>(tolerance));
        }
        move_to(whole, reference, ChainMail::kUnlimited);
        for (int more = 0; !chain.waiting_rows().empty(); ++more) {
          ASSERT_LT(more, 10000);
          chain.finish(state, {}, 50);
          ASSERT_EQ(unexplained(arcs, state, chain, tolerance), 0U) << "scene " << n;
        }
        for (std::size_t axis = 0; axis < 3; ++axis) {
          for (std::size_t i = 0; i < lattice.size(); ++i) {
            ASSERT_NEAR(state.u[axis][i], reference.u[axis][i], kHalfUlp * asked * 4 * (nx + ny + nz));
          }
        }
        continue;
      }
      // Some of it, or nothing, before the next stroke meets what still waits.
      for (int more = random.below(4); more > 0; --more) {
        chain.finish(state, {}, 30);
        ASSERT_EQ(unexplained(arcs, state, chain, tolerance), 0U) << "scene " << n << ", round " << round;
      }
    }
    chain.finish(state, {});
    EXPECT_TRUE(chain.waiting_rows().empty());
    EXPECT_LE(voxel::sparse::worst_violation(lattice, state),
              16 * kHalfUlp * std::max(asked, largest(state)));
    for (std::size_t v = 0; v < lattice.size(); ++v) {
      if (lattice.anchored(static_cast<VoxelId>(v))) {
        ASSERT_EQ(state.at(static_cast<VoxelId>(v)), glm::dvec3(0.0));
      }
    }
  }
  std::cout << partial << " of " << calls << " calls left something waiting\n";
  EXPECT_GT(partial, calls / 2);
}

}  // namespace
