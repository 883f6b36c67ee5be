// SPDX-License-Identifier: GPL-3.0-or-later
// What the chain's tests hold it against: its definition (voxel/chainmail.h), the shortest paths found by
// Bellman and Ford, in double.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <span>
#include <vector>

#include "tests/voxel/lattice_scenes.h"
#include "voxel/chainmail.h"

namespace tests {

using voxel::ChainMail;
using voxel::Displacement;
using voxel::Lattice;
using voxel::Obstacle;
using voxel::VoxelId;

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
inline constexpr double kHalfUlp = 6e-8;  // 2^-24: one rounding of a float, relative

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

inline std::vector<Arc> arcs_of(const Lattice& lattice, int axis) {
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
inline void constrain(const Lattice& lattice, int axis, VoxelId source, double u, Interval& interval) {
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
inline int scenes(int everyday) {
  const char* const wanted = std::getenv("HYBRID_CHAIN_SCENES");  // NOLINT(concurrency-mt-unsafe)
  return wanted != nullptr ? std::atoi(wanted) : everyday;
}

using Intervals = std::array<Interval, 3>;

inline Intervals held_by_anchors(const Lattice& lattice) {
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
inline std::vector<Source> feasible_sources(const RandomScene& scene, const Lattice& lattice, Random& random,
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
inline std::size_t differing_bits(const Lattice& lattice, const Displacement& a, const Displacement& b) {
  std::size_t count = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t v = 0; v < lattice.size(); ++v) {
      if (std::bit_cast<std::uint32_t>(a.u[axis][v]) != std::bit_cast<std::uint32_t>(b.u[axis][v])) ++count;
    }
  }
  return count;
}

inline std::size_t moved_voxels(const Lattice& lattice, const Displacement& state) {
  std::size_t count = 0;
  for (std::size_t v = 0; v < lattice.size(); ++v) {
    if (state.at(static_cast<VoxelId>(v)) != glm::dvec3(0.0)) ++count;
  }
  return count;
}

inline double largest(const Displacement& state) {
  float most = 0.0F;
  for (const auto& axis : state.u) {
    for (const float u : axis) most = std::max(most, std::fabs(u));
  }
  return static_cast<double>(most);
}

// Moves the sources and settles the chain, as a contact does.
inline void pull(const Lattice& lattice, ChainMail& chain, Displacement& state,
                 const std::vector<Source>& sources, std::span<const Obstacle> obstacles = {}) {
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
inline double rounding(const RandomScene& scene, const Displacement& state) {
  const auto& dims = scene.volume.dims;
  return kHalfUlp * largest(state) * 2 * (dims[0] + dims[1] + dims[2]);
}

// The largest difference between a state and its definition, the clamp of the state before into what is
// allowed (m).
inline double error_of_clamp(const Lattice& lattice, const Displacement& before, const Displacement& state,
                             const Intervals& allowed) {
  double worst = 0.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto& [low, high] = allowed[axis];
    for (std::size_t v = 0; v < lattice.size(); ++v) {
      if (!lattice.filled(static_cast<VoxelId>(v))) continue;
      const double expected = std::min(std::max(static_cast<double>(before.u[axis][v]), low[v]), high[v]);
      const double error = std::fabs(static_cast<double>(state.u[axis][v]) - expected);
      if (!std::isfinite(error)) return error;
      worst = std::max(worst, error);
    }
  }
  return worst;
}

// Pulls a scene four times, each time from where the last one left it, and holds it against the definition.
inline void pull_and_compare(const RandomScene& scene, Random& random, int n, double& worst) {
  const Lattice lattice(scene.volume, scene.options);
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
    auto sources =
        feasible_sources(scene, lattice, random, 1 + random.below(n % 2 == 0 ? 3 : 12), false, allowed);
    pull(lattice, chain, state, sources);
    const double tolerance = std::max(rounding(scene, state), rounding(scene, before));
    const double error = error_of_clamp(lattice, before, state, allowed);
    ASSERT_LE(error, tolerance) << "scene " << n << ", round " << round;
    worst = std::max(worst, error / std::max(largest(state), 1e-30));
    Displacement again = before;
    std::reverse(sources.begin(), sources.end());
    pull(lattice, chain, again, sources);
    ASSERT_EQ(differing_bits(lattice, again, state), 0U) << "scene " << n << ", round " << round;
  }
}

}  // namespace tests
