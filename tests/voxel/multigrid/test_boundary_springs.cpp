// SPDX-License-Identifier: GPL-3.0-or-later
// Boundary springs of coarse cells, and the error that remains after a multigrid cycle.
#include "voxel/multigrid/boundary_springs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <iostream>
#include <memory>
#include <random>
#include <span>
#include <vector>

#include "tests/voxel/fixtures/lattice_scenes.h"
#include "voxel/lattice/displacement.h"
#include "voxel/relaxation/relaxation.h"

namespace {

using tests::elastic;
using voxel::BoundarySprings;
using voxel::Displacement;
using voxel::LabelVolume;
using voxel::Lattice;
using voxel::LatticeOptions;
using voxel::LevelStiffness;
using voxel::Relaxation;
using voxel::VoxelId;

constexpr double kH = 1e-3;  // spacing (m)

LabelVolume block(const std::array<int, 3>& dims) {
  return tests::block(dims, glm::dvec3(kH));
}

struct Levels {
  explicit Levels(const Lattice& lattice) {
    for (int n = 0; n < 4; ++n) {
      levels.push_back(std::make_unique<LevelStiffness>(lattice, n == 0 ? nullptr : levels.back().get()));
      pointers.push_back(levels.back().get());
    }
  }
  // Boundary spring of a cell on one axis (N/m).
  double hold(BoundarySprings& holds, int level, VoxelId cell, int axis) {
    const voxel::VoxelSprings springs = pointers[static_cast<std::size_t>(level)]->springs_of(cell);
    if (!holds.any(level, cell / voxel::kRow)) return 0.0;
    return static_cast<double>(
               holds.hold(level, cell / voxel::kRow, static_cast<std::size_t>(axis))[cell % voxel::kRow]) /
           static_cast<double>(springs.inverse[static_cast<std::size_t>(axis)]);
  }
  std::vector<std::unique_ptr<LevelStiffness>> levels;
  std::vector<LevelStiffness*> pointers;
};

// On level l, a fixed plane is (2^l − 1) / 2 voxel links away from the centre of a cell, and 4^l links lie
// side by side.
TEST(BoundarySprings, APlaneStaysWhereItIsOnEveryLevel) {
  LatticeOptions options;
  options.materials[1] = elastic(1e4, 0.3);
  options.anchor_faces = {"-z"};
  const Lattice lattice(block({32, 32, 32}), options);
  Levels levels(lattice);
  BoundarySprings holds(lattice, levels.pointers);
  const voxel::Spring link = lattice.spring_within(1, 2);
  for (int level = 1; level < 4; ++level) {
    const voxel::Grid& g = levels.pointers[static_cast<std::size_t>(level)]->grid();
    const int middle = g.dims[0] / 2;
    const double links = std::ldexp(1.0, 2 * level) / (0.5 * (std::ldexp(1.0, level) - 1.0));
    for (int axis = 0; axis < 3; ++axis) {
      const double one = static_cast<double>(link.on(axis, 2));
      EXPECT_NEAR(levels.hold(holds, level, g.at(middle, middle, 0), axis), links * one, 1e-4 * links * one)
          << level << ' ' << axis;
      EXPECT_EQ(levels.hold(holds, level, g.at(middle, middle, 1), axis), 0.0);
    }
  }
}

// The springs depend only on the voxels that are held now, not on those held before.
TEST(BoundarySprings, DependOnWhatIsHeldAlone) {
  LatticeOptions options;
  options.materials[1] = elastic(1e4, 0.3);
  options.anchor_faces = {"-z"};
  const Lattice lattice(block({24, 20, 18}), options);
  Levels levels(lattice);
  BoundarySprings changed(lattice, levels.pointers);
  std::mt19937 random(5);
  const auto some = [&] {
    std::vector<VoxelId> held;
    held.reserve(12);
    for (int n = 0; n < 12; ++n)
      held.push_back(lattice.grid().at(static_cast<int>(random() % 24), static_cast<int>(random() % 20), 17));
    return held;
  };
  for (int n = 0; n < 30; ++n) {
    const std::vector<VoxelId> held = some();
    changed.set_held(held);
    const VoxelId pressed = some().front();
    changed.support(pressed, BoundarySprings::along(glm::normalize(glm::vec3(0.0F, 0.5F, 1.0F)),
                                                    BoundarySprings::Support::By::obstacle));
    changed.renew();
    BoundarySprings fresh(lattice, levels.pointers);
    fresh.set_held(held);
    fresh.support(pressed, BoundarySprings::along(glm::normalize(glm::vec3(0.0F, 0.5F, 1.0F)),
                                                  BoundarySprings::Support::By::obstacle));
    fresh.renew();
    for (int level = 1; level < 4; ++level) {
      const voxel::Grid& g = levels.pointers[static_cast<std::size_t>(level)]->grid();
      for (voxel::RowId row = 0; row < g.rows(); ++row) {
        ASSERT_EQ(changed.any(level, row), fresh.any(level, row));
        for (std::size_t axis = 0; axis < 3; ++axis) {
          for (int i = 0; i < voxel::kRow; ++i) {
            ASSERT_EQ(changed.hold(level, row, axis)[i], fresh.hold(level, row, axis)[i]);
            ASSERT_EQ(changed.nearer(level, row, axis)[i], fresh.nearer(level, row, axis)[i]);
          }
        }
        ASSERT_EQ(changed.tilted(level, row), fresh.tilted(level, row));
        for (VoxelId cell = row * voxel::kRow; cell < (row + 1) * voxel::kRow; ++cell)
          ASSERT_EQ(changed.tilt(level, cell), fresh.tilt(level, cell));
      }
    }
    changed.support(pressed, {});
  }
}

// The springs of anchors do not depend on when and in which order they are queried, or on the voxels that are
// held in between. They are the same to the last bit as if all were computed at the start.
TEST(BoundarySprings, OfAnchorsAreTheSameWheneverTheyAreAskedFor) {
  std::mt19937 random(9);
  for (int n = 0; n < 6; ++n) {
    LabelVolume volume = block({80, 40, 36});
    LatticeOptions options;
    options.materials[1] = elastic(1e4, 0.3);
    options.materials[2] = elastic(3e5, 0.2);
    options.anchor_labels = {2};
    for (std::uint8_t& label : volume.labels) label = random() % 9 == 0 ? 0 : 1;
    for (int piece = 0; piece < 3; ++piece) {  // boxes of bone of any size
      std::array<int, 3> low{}, high{};
      for (std::size_t d = 0; d < 3; ++d) {
        low[d] = static_cast<int>(random() % static_cast<unsigned>(volume.dims[d]));
        high[d] = std::min(volume.dims[d], low[d] + 1 + static_cast<int>(random() % 20));
      }
      for (int k = low[2]; k < high[2]; ++k) {
        for (int j = low[1]; j < high[1]; ++j) {
          for (int i = low[0]; i < high[0]; ++i) volume.labels[volume.index(i, j, k)] = 2;
        }
      }
    }
    const Lattice lattice(volume, options);
    Levels at_once_levels(lattice), later_levels(lattice);
    BoundarySprings at_once(lattice, at_once_levels.pointers), later(lattice, later_levels.pointers);
    at_once.prepare_all();
    const auto any_row = [&](int level) {
      return static_cast<voxel::RowId>(random() %
                                       later_levels.pointers[static_cast<std::size_t>(level)]->grid().rows());
    };
    for (int step = 0; step < 40; ++step) {
      for (int ask = 0; ask < 5; ++ask) {
        const int level = 1 + static_cast<int>(random() % 3);
        (void)later.any(level, any_row(level));
      }
      std::vector<VoxelId> held;
      while (held.size() < 4) {
        const VoxelId v = lattice.at(static_cast<int>(random() % 80), static_cast<int>(random() % 40),
                                     static_cast<int>(random() % 36));
        if (lattice.filled(v)) held.push_back(v);
      }
      const BoundarySprings::Support by = BoundarySprings::along(glm::normalize(glm::vec3(0.3F, -0.5F, 0.8F)),
                                                                 BoundarySprings::Support::By::tool);
      for (BoundarySprings* holds : {&at_once, &later}) {
        holds->set_held(std::span(held).first(3));
        holds->support(held.back(), by);
        holds->renew();
      }
    }
    for (int level = 1; level < 4; ++level) {
      const voxel::Grid& g = later_levels.pointers[static_cast<std::size_t>(level)]->grid();
      for (voxel::RowId row = 0; row < g.rows(); ++row) {
        ASSERT_EQ(later.any(level, row), at_once.any(level, row)) << level;
        ASSERT_EQ(later.tilted(level, row), at_once.tilted(level, row));
        for (VoxelId i = 0; i < voxel::kRow; ++i) {
          for (std::size_t axis = 0; axis < 3; ++axis) {
            ASSERT_EQ(later.hold(level, row, axis)[i], at_once.hold(level, row, axis)[i]) << level;
            ASSERT_EQ(later.nearer(level, row, axis)[i], at_once.nearer(level, row, axis)[i]);
          }
          ASSERT_EQ(later.tilt(level, row * voxel::kRow + i), at_once.tilt(level, row * voxel::kRow + i));
        }
      }
    }
  }
}

// Voxels that slide on an inclined surface fix the coarse cells around them only along the surface's normal.
TEST(BoundarySprings, WhatSlidesHoldsAlongItsNormalAlone) {
  LatticeOptions options;
  options.materials[1] = elastic(1e4, 0.3);
  options.anchor_faces = {"-z"};
  const Lattice lattice(block({24, 20, 18}), options);
  Levels levels(lattice);
  BoundarySprings holds(lattice, levels.pointers);
  const glm::vec3 n = glm::normalize(glm::vec3(0.5F, -0.4F, 0.8F));
  const voxel::Spring link = lattice.spring_within(1, 2);
  const VoxelId cell = levels.pointers[1]->grid().at(6, 5, 8);
  const auto k = [&link](int axis) { return 8.0 * static_cast<double>(link.on(axis, 2)); };
  double compliance = 0.0;  // along the normal, with the springs of all axes in series (m/N)
  for (int axis = 0; axis < 3; ++axis) compliance += static_cast<double>(n[axis] * n[axis]) / k(axis);
  for (const BoundarySprings::Support::By by :
       {BoundarySprings::Support::By::obstacle, BoundarySprings::Support::By::tool}) {
    for (int j = 0; j < 20; ++j) {
      for (int i = 0; i < 24; ++i) holds.support(lattice.grid().at(i, j, 17), BoundarySprings::along(n, by));
    }
    holds.renew();
    const auto expected = [&](int row, int column) {
      const double of_springs =
          by == BoundarySprings::Support::By::tool ? 1.0 / compliance : std::sqrt(k(row) * k(column));
      return of_springs * static_cast<double>(n[row] * n[column]);
    };
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(levels.hold(holds, 1, cell, axis), expected(axis, axis), 0.02 * k(axis)) << axis;
    constexpr std::array<std::array<int, 2>, 3> pairs{{{0, 1}, {0, 2}, {1, 2}}};
    for (std::size_t p = 0; p < 3; ++p) {
      EXPECT_NEAR(static_cast<double>(holds.tilt(1, cell)[p]), expected(pairs[p][0], pairs[p][1]),
                  0.02 * k(2))
          << p;
    }
  }
}

// A boundary spring never pushes a cell away from rest, however surfaces are inclined. So its matrix is
// positive semidefinite.
TEST(BoundarySprings, NeverPush) {
  LatticeOptions options;
  options.materials[1] = elastic(1e4, 0.3);
  options.anchor_faces = {"-x"};
  const Lattice lattice(block({24, 20, 18}), options);
  Levels levels(lattice);
  BoundarySprings holds(lattice, levels.pointers);
  std::mt19937 random(7);
  std::normal_distribution<float> any;
  for (int j = 3; j < 17; ++j) {
    for (int i = 2; i < 22; ++i) {
      const glm::vec3 n = glm::normalize(glm::vec3(any(random), any(random), any(random)));
      const auto by =
          random() % 2 == 0 ? BoundarySprings::Support::By::obstacle : BoundarySprings::Support::By::tool;
      if (random() % 3 != 0) holds.support(lattice.grid().at(i, j, 17), BoundarySprings::along(n, by));
    }
  }
  holds.renew();
  int tilted = 0;
  for (int level = 1; level < 4; ++level) {
    const voxel::Grid& g = levels.pointers[static_cast<std::size_t>(level)]->grid();
    for (int j = 0; j < g.dims[1]; ++j) {
      for (int i = 0; i < g.dims[0]; ++i) {
        const VoxelId cell = g.at(i, j, g.dims[2] - 1);
        const auto off = holds.tilt(level, cell);
        if (off == std::array<float, 3>{}) continue;
        ++tilted;
        const double x = levels.hold(holds, level, cell, 0), y = levels.hold(holds, level, cell, 1),
                     z = levels.hold(holds, level, cell, 2);
        const double xy = static_cast<double>(off[0]), xz = static_cast<double>(off[1]),
                     yz = static_cast<double>(off[2]);
        const double most = std::max({x, y, z});
        EXPECT_GE(x * y - xy * xy, -1e-5 * most * most);
        EXPECT_GE(x * z - xz * xz, -1e-5 * most * most);
        EXPECT_GE(y * z - yz * yz, -1e-5 * most * most);
        EXPECT_GE(x * y * z + 2.0 * xy * xz * yz - x * yz * yz - y * xz * xz - z * xy * xy,
                  -1e-5 * most * most * most);
      }
    }
  }
  EXPECT_GT(tilted, 50);
}

// Runs six cycles on a block with a smooth initial displacement whose solution is 0. Returns the mean factor
// by which a cycle reduces the error in the energy norm. A patch of the surface is held, or slides as on a
// ball.
enum class Patch : std::uint8_t { held, slides };
double left_by_a_cycle(const std::array<int, 3>& dims, int patch, Patch by = Patch::held) {
  LatticeOptions options;
  options.materials[1] = {
      .young_Pa = 1e4, .poisson = 0.3, .stretch_min = 1e-3, .stretch_max = 1e3, .shear = 1e3};
  options.anchor_faces = {"-z"};
  const Lattice lattice(block(dims), options);
  Displacement state(lattice);
  std::vector<VoxelId> held;
  for (int k = 1; k < dims[2]; ++k) {
    for (int j = 0; j < dims[1]; ++j) {
      for (int i = 0; i < dims[0]; ++i) {
        const VoxelId v = lattice.grid().at(i, j, k);
        if (k == dims[2] - 1 && 2 * std::abs(i - dims[0] / 2) < patch &&
            2 * std::abs(j - dims[1] / 2) < patch) {
          state.set_role(v, by == Patch::held ? Displacement::held : Displacement::pressed);
          if (by == Patch::slides) {
            state.tool_normal[lattice.surface_number(v)] = glm::normalize(
                glm::vec3(static_cast<float>(2 * i - dims[0]) / static_cast<float>(patch),
                          static_cast<float>(2 * j - dims[1]) / static_cast<float>(patch), 1.0F));
          }
          held.push_back(v);
          continue;
        }
        for (auto& axis : state.u)
          axis[v] = static_cast<float>(0.1 * kH * std::sin(1.5 * static_cast<double>(k) / (dims[2] - 1)));
      }
    }
  }
  const auto energy = [&] {
    double sum = 0.0;
    for (VoxelId v = 0; v < lattice.size(); ++v) {
      for (int d = 0; d < 3 && lattice.filled(v); ++d) {
        const VoxelId w = lattice.up(v, d);
        if (!lattice.filled(w)) continue;
        const voxel::Spring spring = lattice.spring(v, d);
        for (int axis = 0; axis < 3; ++axis) {
          const auto& u = state.u[static_cast<std::size_t>(axis)];
          const double stretch = static_cast<double>(u[w]) - static_cast<double>(u[v]);
          sum += 0.5 * static_cast<double>(spring.on(axis, d)) * stretch * stretch;
        }
      }
    }
    return sum;
  };
  Relaxation relaxation(lattice);
  relaxation.set_tolerance(1e-12 * lattice.force_scale_N());
  relaxation.mark_all_dirty();
  constexpr int kCycles = 6;
  const double before = energy();
  for (int n = 0; n < kCycles; ++n) {
    relaxation.wake();
    relaxation.run_cycle(state, {}, held);
  }
  return std::pow(energy() / before, 0.5 / kCycles);
}

TEST(BoundarySprings, ACycleLeavesAsLittleOfTheErrorAtAnySize) {
  for (const int size : {8, 16, 32, 64}) {
    const double left = left_by_a_cycle({size, size, size}, 0);
    std::cout << size << " voxels an edge: " << left << '\n';
    EXPECT_LT(left, 0.3) << size;
  }
  for (const int size :
       {9, 17, 33, 61}) {  // on some levels or all, an outermost cell has only one layer of finer cells
    const double left = left_by_a_cycle({size, size, size}, 0);
    std::cout << size << " voxels an edge: " << left << '\n';
    EXPECT_LT(left, 0.45) << size;
  }
  EXPECT_LT(left_by_a_cycle({1, 1, 64}, 0), 0.33);
}

TEST(BoundarySprings, ACycleRoundWhatTheToolHoldsLeavesNoMore) {
  for (const int patch : {1, 5, 9, 17}) {
    const double left = left_by_a_cycle({33, 31, 30}, patch);
    std::cout << patch << " voxels held: " << left << '\n';
    EXPECT_LT(left, 0.45) << patch;
  }
}

// A cycle also leaves little error around a patch that is small compared with the block, and around a sliding
// patch. Coarse levels hardly resolve such a small patch.
TEST(BoundarySprings, ACycleRoundASmallOrSlidingPatchLeavesNoMore) {
  for (const int size : {48, 96}) {
    for (const Patch by : {Patch::held, Patch::slides}) {
      const double left = left_by_a_cycle({size, size, size}, 17, by);
      std::cout << size << (by == Patch::held ? " held: " : " slides: ") << left << '\n';
      EXPECT_LT(left, 0.5) << size;
    }
  }
}

}  // namespace
