// SPDX-License-Identifier: GPL-3.0-or-later
// Dependents through links at their limits, against a reference that searches voxel by voxel.
#include "voxel/relaxation/limit_reactions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>
#include <set>

#include "tests/voxel/fixtures/lattice_scenes.h"
#include "voxel/chain/chainmail.h"
#include "voxel/lattice/voxel_links.h"

namespace {

using tests::Random;
using voxel::Displacement;
using voxel::Lattice;
using voxel::VoxelId;

constexpr float kTight = 1e-4F;  // in spacings, as in the code under test

// Calls visit(w, pushed_up, pushed_down) for each neighbour w of v whose link to v is at a limit.
template <class Visit>
void for_tight(const Lattice& lattice, const Displacement& state, VoxelId v, int axis, const Visit& visit) {
  const auto& u = state.u[static_cast<std::size_t>(axis)];
  for (int d = 0; d < 3; ++d) {
    const float tight = kTight * static_cast<float>(lattice.spacing_m()[d]);
    const VoxelId up = lattice.up(v, d), down = lattice.down(v, d);
    if (lattice.filled(up)) {
      const auto b = lattice.bounds(v, d, axis);
      const float difference = u[up] - u[v];
      const bool low = difference <= b[0] + tight, high = difference >= b[1] - tight;
      if (low || high) visit(up, low, high);
    }
    if (lattice.filled(down)) {
      const auto b = lattice.bounds(down, d, axis);
      const float difference = u[v] - u[down];
      const bool low = difference <= b[0] + tight, high = difference >= b[1] - tight;
      if (low || high) visit(down, high, low);
    }
  }
}

// Reference. A voxel whose load is within rounding may or may not be a dependent. For such a voxel the result
// of `rows` is used.
std::set<VoxelId> looked_for(const Lattice& lattice, voxel::LevelStiffness& couplings,
                             const Displacement& state, const std::vector<VoxelId>& sources, int axis,
                             const voxel::LimitReactions& rows) {
  std::set<VoxelId> found(sources.begin(), sources.end());
  std::vector<VoxelId> waiting = sources;
  while (!waiting.empty()) {
    const VoxelId v = waiting.back();
    waiting.pop_back();
    for_tight(lattice, state, v, axis, [&](VoxelId w, bool pushed_up, bool pushed_down) {
      if (lattice.anchored(w) || found.contains(w)) return;
      const double pull = link_force(couplings, state, w, axis);
      const bool unsure = std::abs(pull) < 1e-6 * lattice.force_scale_N();
      const bool hangs =
          (pushed_up && pull < 0.0) || (pushed_down && pull > 0.0) || (pushed_up && pushed_down);
      if (unsure ? !rows.gathered(w) : !hangs) return;
      found.insert(w);
      waiting.push_back(w);
    });
  }
  return found;
}

struct Counts {
  std::size_t hung = 0, most = 0;
  int across = 0;  // number of sets that reach, along x, into rows without a source
};

// Pushes some voxels of a lattice so far that others follow, and compares.
void compare(const voxel::LabelVolume& volume, const voxel::LatticeOptions& options,
             const std::vector<std::size_t>& filled, Random& random, Counts& counts) {
  const Lattice lattice(volume, options);
  Displacement state(lattice);
  voxel::LevelStiffness couplings(lattice, nullptr);
  voxel::ChainMail chain(lattice);
  std::vector<VoxelId> sources;
  std::vector<glm::vec3> moves;
  for (int n = 1 + random.below(4); n > 0; --n) {
    const VoxelId v = tests::voxel_of(
        lattice, volume, filled[static_cast<std::size_t>(random.below(static_cast<int>(filled.size())))]);
    if (lattice.anchored(v) || std::find(sources.begin(), sources.end(), v) != sources.end()) continue;
    glm::dvec3 move(0.0);
    for (int axis = 0; axis < 3; ++axis) move[axis] = random.between(-3.0, 3.0) * lattice.min_spacing_m();
    state.set(v, move);
    sources.push_back(v);
    moves.emplace_back(move);
  }
  if (sources.empty()) return;
  chain.settle(state, sources, moves, {});
  std::sort(sources.begin(), sources.end());
  const auto is_root = [&](VoxelId v) { return std::binary_search(sources.begin(), sources.end(), v); };
  voxel::LimitReactions rows(lattice);
  for (int axis = 0; axis < 3; ++axis) {
    rows.gather(couplings, state, sources, axis);
    const std::set<VoxelId> wanted = looked_for(lattice, couplings, state, sources, axis, rows);
    double force = 0.0, stiffness = 0.0, size = 0.0;
    for (const VoxelId v : wanted) {
      if (is_root(v)) continue;
      EXPECT_TRUE(rows.gathered(v)) << "voxel " << v << ", axis " << axis;
      const double own = link_force(couplings, state, v, axis);
      force += own;
      size += std::abs(own);
      const voxel::VoxelSprings springs = couplings.springs_of(v);
      for (int d = 0; d < 3; ++d) {
        const auto ud = static_cast<std::size_t>(d);
        if (!wanted.contains(lattice.up(v, d))) stiffness += static_cast<double>(springs.up[ud].on(axis, d));
        if (!wanted.contains(lattice.down(v, d)))
          stiffness += static_cast<double>(springs.down[ud].on(axis, d));
      }
    }
    std::size_t carried = 0;
    for (const std::size_t index : filled) {
      const VoxelId v = tests::voxel_of(lattice, volume, index);
      carried += rows.gathered(v) && !is_root(v) ? 1 : 0;
    }
    EXPECT_EQ(carried, wanted.size() - sources.size());
    const voxel::LimitReactions::Dependents hanging = rows.dependents(couplings);
    EXPECT_NEAR(hanging.force_N, force, 1e-5 * size + 1e-6 * lattice.force_scale_N());
    EXPECT_NEAR(hanging.stiffness_N_per_m, stiffness, 1e-5 * stiffness);
    for (const VoxelId root : sources) {
      bool tight = false;
      for_tight(lattice, state, root, axis,
                [&](VoxelId w, bool, bool) { tight = tight || !lattice.anchored(w); });
      EXPECT_EQ(rows.at_limit(root), tight);
    }
    counts.hung += wanted.size() - sources.size();
    counts.most = std::max(counts.most, wanted.size());
    std::set<int> columns;
    for (const VoxelId v : sources) columns.insert(lattice.coordinates(v)[0] / voxel::kRow);
    counts.across += std::any_of(wanted.begin(), wanted.end(), [&](VoxelId v) {
      return !columns.contains(lattice.coordinates(v)[0] / voxel::kRow);
    });
  }
}

TEST(LimitReactions, AreThoseFoundVoxelByVoxelInRandomScenes) {
  Random random(11);
  Counts counts;
  for (int n = 0; n < 300; ++n) {
    const tests::RandomScene scene = tests::random_scene(random);
    compare(scene.volume, scene.options, scene.filled, random, counts);
  }
  std::cout << counts.hung << " voxels hung, " << counts.most << " at most at a time\n";
  EXPECT_GT(counts.hung, 1000U);
}

TEST(LimitReactions, GoOnFromRowToRow) {
  // Tests objects wider than a row of 32 voxels. They have one label (rows share springs) or three.
  Random random(12);
  Counts counts;
  for (int n = 0; n < 300; ++n) {
    voxel::LabelVolume volume = tests::block({100, 9, 8}, glm::dvec3(1e-3));
    voxel::LatticeOptions options;
    for (std::size_t label = 1; label <= 3; ++label) {
      const double slack = random.between(0.02, 0.1);
      options.materials[label] = {.young_Pa = random.between(1e3, 1e4),
                                  .poisson = 0.3,
                                  .stretch_min = 1.0 - slack,
                                  .stretch_max = 1.0 + slack,
                                  .shear = slack};
    }
    if (n % 2 != 0) {
      for (auto& label : volume.labels) label = static_cast<std::uint8_t>(1 + random.below(3));
    }
    options.anchor_faces = {"-z"};
    std::vector<std::size_t> filled(volume.labels.size());
    for (std::size_t i = 0; i < filled.size(); ++i) filled[i] = i;
    compare(volume, options, filled, random, counts);
  }
  std::cout << counts.hung << " voxels hung, " << counts.most << " at most at a time, in " << counts.across
            << " of 900 cases from row to row\n";
  EXPECT_GT(counts.across, 5);
}

TEST(LimitReactions, WhatHasNoSlackHangsOnItAllWhateverPullsIt) {
  // A plate without slack moves as a whole on tissue. No link in the plate is stretched, so the voxels
  // between the sources and the tissue have no load of their own.
  voxel::LabelVolume volume = tests::block({40, 10, 8}, glm::dvec3(1e-3));
  for (std::size_t i = 0; i < volume.labels.size(); ++i) {
    if (i >= volume.index(0, 0, 4)) volume.labels[i] = 2;
  }
  voxel::LatticeOptions options = tests::made_of(tests::elastic(1e4, 0.3));
  options.materials[2] = {
      .young_Pa = 1e5, .poisson = 0.3, .stretch_min = 1.0, .stretch_max = 1.0, .shear = 0.0};
  const Lattice lattice(volume, options);
  Displacement state(lattice);
  for (std::size_t i = 0; i < volume.labels.size(); ++i) {
    if (volume.labels[i] == 2) state.set(tests::voxel_of(lattice, volume, i), {0.0, 0.0, -5e-4});
  }
  voxel::LevelStiffness couplings(lattice, nullptr);
  voxel::LimitReactions rows(lattice);
  const std::vector<VoxelId> root{lattice.at(35, 5, 7)};
  rows.gather(couplings, state, root, 2);
  for (std::size_t i = 0; i < volume.labels.size(); ++i)
    EXPECT_EQ(rows.gathered(tests::voxel_of(lattice, volume, i)), volume.labels[i] == 2);
  // each link to the tissue below is compressed by half a spacing
  double below = 0.0;
  for (int i = 0; i < 40; ++i) {
    for (int j = 0; j < 10; ++j) below += static_cast<double>(lattice.spring(lattice.at(i, j, 3), 2).along);
  }
  EXPECT_NEAR(rows.dependents(couplings).force_N, below * 5e-4, 1e-4 * below * 5e-4);
}

}  // namespace
