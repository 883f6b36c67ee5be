// SPDX-License-Identifier: GPL-3.0-or-later
// The methods of a wave (voxel/chain/wave.h): cones and sweeps, their rounding over a long session, and
// budgets.
#include "voxel/chain/wave.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <iostream>
#include <unordered_set>
#include <vector>

#include "tests/voxel/fixtures/chain_reference.h"
#include "tests/voxel/fixtures/lattice_scenes.h"
#include "voxel/chain/chainmail.h"
#include "voxel/lattice/voxel_links.h"

namespace {

using namespace tests;
using voxel::LatticeOptions;
using voxel::RowId;

// Bodies of one material, most of them wider than a row, are pushed at their surface. The voxels move in
// cones of closed form, which end at faces and anchors. The bodies are blocks, blocks with a slit, and
// lenses.
TEST(ChainMail, ConesAreTheClampToo) {
  Random random(15);
  double worst = 0.0;
  for (int n = 0; n < scenes(15); ++n) {
    RandomScene scene;
    scene.volume = block({20 + random.below(60), 5 + random.below(12), 5 + random.below(12)},
                         {random.between(0.5e-3, 2e-3), random.between(0.5e-3, 2e-3), 1e-3});
    auto& volume = scene.volume;
    if (n % 3 == 0) {  // a lens; in the next case, a slit in a block
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
    pull_and_compare(scene, random, n, worst);
  }
  std::cout << "largest error " << worst << " of the largest displacement\n";
}

// Blocks of many materials over several rows, in layers, in lumps or at random, with holes and anchors. Rows
// have one label or many. Some scenes have more labels than two registers of half limits can hold.
TEST(ChainMail, SweepsAreTheClampToo) {
  Random random(18);
  double worst = 0.0;
  for (int n = 0; n < scenes(24); ++n) {
    RandomScene scene;
    scene.volume = block({20 + random.below(90), 4 + random.below(12), 4 + random.below(12)},
                         {random.between(0.5e-3, 2e-3), random.between(0.5e-3, 2e-3), 1e-3});
    auto& volume = scene.volume;
    const int kind = n % 4, labels = kind == 2 ? 40 : 2 + random.below(12), thick = 1 + random.below(5);
    const double holes = random.below(2) * 0.03;
    for (int k = 0; k < volume.dims[2]; ++k) {
      for (int j = 0; j < volume.dims[1]; ++j) {
        for (int i = 0; i < volume.dims[0]; ++i) {
          const int any = random.below(labels), lump = (i / (3 * thick) + j / thick + k / thick) % labels;
          const int label = 1 + (kind == 0 ? k / thick % labels : kind == 3 ? lump : any);
          volume.labels[volume.index(i, j, k)] = static_cast<std::uint8_t>(random.unit() < holes ? 0 : label);
        }
      }
    }
    for (std::size_t v = 0; v < volume.labels.size(); ++v) {
      if (volume.labels[v] != 0) scene.filled.push_back(v);
    }
    scene.options.anchor_faces = {random.below(2) != 0 ? "-z" : "-x"};
    for (std::size_t label = 1; label <= 40; ++label) {
      scene.options.materials[label] = {.stretch_min = random.between(0.5, 0.95),
                                        .stretch_max = random.between(1.05, 1.8),
                                        .shear = random.between(0.05, 0.5)};
    }
    for (int anchors = random.below(4); anchors > 0; --anchors) {
      scene.options.anchor_voxels.push_back(
          scene.filled[static_cast<std::size_t>(random.below(static_cast<int>(scene.filled.size())))]);
    }
    pull_and_compare(scene, random, n, worst);
  }
  std::cout << "largest error " << worst << " of the largest displacement\n";
}

TEST(ChainMail, RoundingDoesNotAddUpOverASession) {
  // Thousands of small strokes in random directions, over tissue of one and of three materials.
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
      worst = std::max(worst, voxel::worst_violation(lattice, state));
    }
    std::cout << materials << " materials: " << strokes << " strokes, largest violation " << early / most
              << " of the largest displacement in the first quarter, " << late / most << " after\n";
    EXPECT_LE(early, 8 * kHalfUlp * most);
    EXPECT_LE(late, 8 * kHalfUlp * most);
  }
}

// Number of links that exceed their limits by more than `tolerance`, although neither of their voxels is in a
// waiting row.
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
      count += rows.count(arc.from / voxel::kRow) + rows.count(arc.to / voxel::kRow) == 0 ? 1 : 0;
    }
  }
  return count;
}

TEST(ChainMail, WhatIsBeyondABudgetWaitsAndIsFinished) {
  Random random(17);
  std::size_t partial = 0, stopped = 0, calls = 0, sweeping_calls = 0;
  for (int n = 0; n < scenes(40); ++n) {
    // In most scenes the budget is too small for a sweep. In every fourth scene a sweep can begin.
    const bool sweeps = n % 4 == 3;
    const std::uint64_t budget = sweeps ? 1540 : 100;
    const int least = sweeps ? 24 : 10;
    auto volume =
        block({40 + random.below(30), least + random.below(20), least + random.below(20)}, glm::dvec3(1e-3));
    const int materials = 1 + 2 * random.below(2);
    for (auto& label : volume.labels) label = static_cast<std::uint8_t>(1 + random.below(materials));
    LatticeOptions options = tests::made_of({.stretch_min = 0.9, .stretch_max = 1.1, .shear = 0.1});
    options.materials[2] = {.stretch_min = 0.85, .stretch_max = 1.13, .shear = 0.17};
    const Lattice lattice(volume, options);
    const std::array arcs{arcs_of(lattice, 0), arcs_of(lattice, 1), arcs_of(lattice, 2)};
    ChainMail chain(lattice), whole(lattice);
    Displacement state(lattice), reference(lattice);
    const int nx = volume.dims[0], ny = volume.dims[1], nz = volume.dims[2];
    const double far = 0.1e-3 * (nz - 1);  // at most the length of the chain from the anchors (m)
    double asked = 0.0;
    for (int round = 0; round < 4; ++round) {
      const VoxelId v = voxel_at(lattice, random.below(nx), random.below(ny), nz - 1);
      glm::vec3 place(0.0F);
      for (int a = 0; a < 3; ++a) {
        const double part = random.between(-1.0, 1.0);
        place[a] =
            static_cast<float>(far * (sweeps ? std::copysign(0.5 + 0.5 * std::fabs(part), part) : part));
      }
      asked = std::max(asked, largest(state));
      for (int a = 0; a < 3; ++a) asked = std::max(asked, std::fabs(static_cast<double>(place[a])));
      const double tolerance = 16 * kHalfUlp * asked;
      const auto move_to = [&](ChainMail& with, Displacement& of, std::uint64_t most) {
        const glm::vec3 move = place - glm::vec3(of.at(v));
        of.set(v, glm::dvec3(place));
        with.settle(of, {&v, 1}, {&move, 1}, {}, most);
      };
      move_to(chain, state, budget);
      (sweeps ? sweeping_calls : calls) += 1;
      const std::size_t waits = chain.waiting_rows().empty() ? 0 : 1;
      (sweeps ? stopped : partial) += waits;
      ASSERT_EQ(unexplained(arcs, state, chain, tolerance), 0U) << "scene " << n << ", round " << round;
      if (round == 0) {
        // The source is at its prescribed place, and its own links keep their limits, whichever rows still
        // wait.
        EXPECT_EQ(state.at(v), glm::dvec3(place));
        for (int axis = 0; axis < 3; ++axis) {
          const auto interval = voxel::link_interval(lattice, state, v, axis);
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
      // Finishes some of the waiting rows, or none, before the next stroke.
      for (int more = random.below(4); more > 0; --more) {
        chain.finish(state, {}, 30);
        ASSERT_EQ(unexplained(arcs, state, chain, tolerance), 0U) << "scene " << n << ", round " << round;
      }
    }
    chain.finish(state, {});
    EXPECT_TRUE(chain.waiting_rows().empty());
    EXPECT_LE(voxel::worst_violation(lattice, state), 16 * kHalfUlp * std::max(asked, largest(state)));
    for (std::size_t v = 0; v < lattice.size(); ++v) {
      if (lattice.anchored(static_cast<VoxelId>(v))) {
        ASSERT_EQ(state.at(static_cast<VoxelId>(v)), glm::dvec3(0.0));
      }
    }
  }
  std::cout << partial << " of " << calls << " calls left something waiting, " << stopped << " of "
            << sweeping_calls << " with enough for a sweep\n";
  EXPECT_GT(partial, calls / 2);
  EXPECT_GT(stopped, sweeping_calls / 5);
}

}  // namespace
