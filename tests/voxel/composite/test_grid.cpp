// SPDX-License-Identifier: GPL-3.0-or-later
// CompositeGrid against its reference: the whole lattice at equilibrium within its limits. Small lattices are
// solved directly. For large lattices, nested patches are compared with a CompositeGrid that has all voxels
// on level 0.
#include "voxel/composite/grid.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <iostream>
#include <memory>

#include "tests/voxel/composite/body_on_grid.h"
#include "tests/voxel/fixtures/lattice_scenes.h"

namespace {

using tests::below;
using tests::block;
using tests::Body;
using tests::compare;
using tests::Difference;
using tests::everywhere;
using tests::kSpacing;
using tests::made_of;
using tests::patches_against_all;
using tests::press;
using tests::PressedSquare;
using tests::slack;
using voxel::CompositeGrid;
using voxel::Lattice;
using voxel::LinkMaterial;
using voxel::VoxelId;
using Index3 = CompositeGrid::Index3;

// If level 0 covers the object, the result is the lattice's equilibrium, whatever the object's dimensions.
TEST(CompositeGrid, AllVoxelsAreTheLatticeAtEquilibrium) {
  for (const Index3& dims : {Index3{13, 13, 11}, Index3{12, 15, 10}, Index3{9, 16, 14}}) {
    for (const double depth : {0.3, 1.0}) {
      const Body body(dims, 0.15, everywhere, below);
      const PressedSquare patch{{dims[0] / 2, dims[1] / 2, dims[2] - 1}, 2, depth * kSpacing};
      const Difference d = compare(body, patch, CompositeGrid::kRefineAll);
      EXPECT_LT(d.displacement, 1e-3);
      EXPECT_LT(d.force, 2e-3);
    }
  }
}

TEST(CompositeGrid, AnchorsAreHeldWhereverTheyAre) {
  const Index3 dims{15, 13, 12};
  const PressedSquare patch{{7, 6, 11}, 2, 0.8 * kSpacing};
  const Body sides(dims, 0.2, everywhere,
                   [](const Index3& p) { return p[0] == 0 || p[0] == 14 || p[1] == 0; });
  Difference d = compare(sides, patch, CompositeGrid::kRefineAll);
  EXPECT_LT(d.displacement, 2e-3);
  EXPECT_LT(d.force, 5e-3);
  const Body lump(dims, 0.2, everywhere, [](const Index3& p) { return p[0] < 5 && p[1] > 7 && p[2] < 6; });
  // At the edge of the anchors some links exceed their limits. The grid's bounds do not prevent this.
  d = compare(lump, patch, CompositeGrid::kRefineAll);
  EXPECT_LT(d.displacement, 0.06);
  EXPECT_LT(d.force, 0.03);
}

TEST(CompositeGrid, HolesAndNotchesAreInTheLinks) {
  const Index3 dims{15, 14, 13};
  const PressedSquare patch{{7, 7, 12}, 2, 0.8 * kSpacing};
  const Body hole(
      dims, 0.2, [](const Index3& p) { return std::hypot(p[0] - 7.0, p[2] - 6.0) > 2.5; }, below);
  Difference d = compare(hole, patch, CompositeGrid::kRefineAll);
  EXPECT_LT(d.displacement, 0.01);
  EXPECT_LT(d.force, 0.01);
  const Body notch(
      dims, 0.2, [](const Index3& p) { return p[2] < 8 || p[0] < 11 || p[0] > 11; }, below);
  d = compare(notch, patch, CompositeGrid::kRefineAll);
  EXPECT_LT(d.displacement, 0.02);
  EXPECT_LT(d.force, 0.02);
}

// Coarse levels have links across a narrow gap. Chains must not cross it.
TEST(CompositeGrid, ChainsGoRoundNarrowGaps) {
  const Index3 dims{19, 17, 19};
  for (const int wide : {1, 3}) {
    const auto notched = [wide](const Index3& p) { return p[2] < 8 || p[0] < 12 || p[0] >= 12 + wide; };
    const Body body(dims, 0.1, notched, below);
    Difference d = compare(body, {{8, 8, 18}, 2, 0.8 * kSpacing}, CompositeGrid::kRefineAll);
    EXPECT_LT(d.displacement, 1e-4);
    EXPECT_LT(d.force, 1e-4);
    // At the ends of the gap some links exceed their limits. The grid's bounds do not prevent this.
    d = compare(body, {{8, 8, 18}, 2, 1.4 * kSpacing}, CompositeGrid::kRefineAll);
    EXPECT_LT(d.displacement, 0.06);
    EXPECT_LT(d.force, 0.03);
  }
}

// A plate of single voxels joins two blocks.
TEST(CompositeGrid, SheetsOfSingleVoxelsAreInTheLinks) {
  const auto joined = [](const Index3& p) { return p[2] < 4 || p[2] > 8 || p[0] == 7; };
  const Body body({15, 14, 13}, 0.2, joined, below);
  const Difference d = compare(body, {{7, 7, 12}, 2, 0.8 * kSpacing}, CompositeGrid::kRefineAll);
  EXPECT_LT(d.displacement, 0.02);
  EXPECT_LT(d.force, 0.02);
}

TEST(CompositeGrid, PatchesAreWithinAFewPartsInAHundredOfAllVoxels) {
  for (const int n : {57, 64, 70}) {
    const PressedSquare patch{{n / 2, n / 2, n - 1}, 4, 2.5 * kSpacing};
    EXPECT_LT(patches_against_all(Body({n, n, n}, 0.1, everywhere, below), patch), 0.03) << n;
  }
}

TEST(CompositeGrid, PatchesInOtherShapes) {
  const int n = 60;
  const PressedSquare patch{{n / 2, n / 2, n - 1}, 4, 2.0 * kSpacing};
  const auto sides = [](const Index3& p) { return p[0] == 0 || p[0] == 59 || p[1] == 0 || p[1] == 59; };
  EXPECT_LT(patches_against_all(Body({n, n, n}, 0.1, everywhere, sides), patch), 0.05);
  const auto notched = [](const Index3& p) { return p[2] < 40 || p[0] < 42 || p[0] > 46; };
  EXPECT_LT(patches_against_all(Body({n, n, n}, 0.1, notched, below), patch), 0.08);
  const auto hollow = [](const Index3& p) { return std::hypot(p[0] - 30.0, p[2] - 22.0) > 9.0; };
  EXPECT_LT(patches_against_all(Body({n, n, n}, 0.1, hollow, below), patch), 0.07);
}

// The result does not depend on earlier places of the patches, or on the path of the tool.
TEST(CompositeGrid, ThePathThereIsForgotten) {
  const int n = 64;
  const Body body({n, n, n}, 0.1, everywhere, below);
  const auto at = [&](int x, double depth) { return PressedSquare{{x, n / 2, n - 1}, 3, depth * kSpacing}; };
  CompositeGrid direct(*body.lattice, 10), round(*body.lattice, 10);
  direct.begin({n / 2, n / 2, n - 1});
  press(direct, at(n / 2, 2.0), 30);
  round.begin({n / 2, n / 2, n - 1});
  press(round, at(n / 2, 3.0), 5);
  for (int x = n / 2; x < n / 2 + 10; x += 2) {
    round.centre_on({x, n / 2, n - 1});
    press(round, at(x, 3.0), 2);
  }
  for (int x = n / 2 + 10; x >= n / 2; x -= 2) {
    round.centre_on({x, n / 2, n - 1});
    press(round, at(x, 2.0), 2);
  }
  press(round, at(n / 2, 2.0), 30);
  EXPECT_NEAR(round.force_on_tool_N().z, direct.force_on_tool_N().z, 2e-3 * direct.force_on_tool_N().z);
  for (int n_cycles = 0; n_cycles < 40; ++n_cycles) {
    round.clear_pressed();
    round.cycle();
  }
  EXPECT_LT(glm::length(round.force_on_tool_N()), 1e-3 * direct.force_on_tool_N().z);
}

// A tool holds a voxel sideways and lets go, while another voxel has a bound far from its place. The first
// voxel then follows its links, not the other bound.
TEST(CompositeGrid, ANodeThatIsReleasedStays) {
  const Body body({32, 32, 32}, 0.1, everywhere, below);
  const Index3 held{16, 16, 31}, beside{20, 16, 31};
  CompositeGrid grid(*body.lattice, 8);
  grid.begin(held);
  const auto cycle = [&](bool sideways) {
    grid.clear_pressed();
    grid.press(held, kSpacing * glm::dvec3(0.0, 0.0, -0.3), glm::dvec3(0.0, 0.0, -1.0));
    grid.press(beside, kSpacing * glm::dvec3(3.0, 0.0, 0.0), glm::dvec3(-1.0, 0.0, 0.0));
    if (sideways) grid.press(held, kSpacing * glm::dvec3(-0.1, 0.0, -0.3), glm::dvec3(-1.0, 0.0, 0.0));
    grid.cycle();
  };
  for (int n = 0; n < 20; ++n) cycle(true);
  EXPECT_NEAR(grid.at(held).x, -0.1 * kSpacing, 1e-3 * kSpacing);
  const double force_N = grid.force_on_tool_N().x;
  for (int n = 0; n < 20; ++n) {
    cycle(false);
    EXPECT_LT(std::fabs(grid.at(held).x), 0.1 * kSpacing) << n;
    EXPECT_LT(std::fabs(grid.force_on_tool_N().x), std::fabs(force_N)) << n;
  }
  EXPECT_NEAR(grid.at(held).x, 0.0, 1e-3 * kSpacing);
}

// Some or all levels are built before the contact. They are bit for bit the levels that begin() would build.
TEST(CompositeGrid, LevelsBuiltAheadAreThoseBuiltInTime) {
  const int n = 100;
  const Body body({n, n, n}, 0.1, everywhere, below);
  const PressedSquare patch{{80, 31, n - 1}, 3, 2.0 * kSpacing};
  const auto force = [&](int ahead) {
    CompositeGrid grid(*body.lattice, 10);
    for (int tick = 0; tick < ahead; ++tick) grid.prepare(patch.middle);
    grid.begin(patch.middle);
    press(grid, patch, 12);
    return grid.force_on_tool_N();
  };
  const glm::dvec3 in_time = force(0);
  EXPECT_GT(in_time.z, 0.1);
  for (const int ahead : {1, 2, 4, 20}) EXPECT_EQ(force(ahead), in_time) << ahead;
}

// The contact is always well inside the patch of level 0, whether it jumps or slides.
TEST(CompositeGrid, TheFinestPatchHasTheContactAtEachTick) {
  const int n = 100;
  const Body body({n, n, n}, 0.1, everywhere, below);
  CompositeGrid grid(*body.lattice, 8);
  grid.begin({20, 20, n - 1});
  const auto has_all_round = [&](const Index3& at) {
    for (int j = -3; j <= 3; ++j) {
      for (int i = -3; i <= 3; ++i) {
        if (!grid.in_fine_patch({at[0] + i, at[1] + j, at[2]})) return false;
      }
    }
    return true;
  };
  for (int x = 20; x < 80; ++x) {
    grid.centre_on({x, 20, n - 1});
    EXPECT_TRUE(has_all_round({x, 20, n - 1})) << x;
  }
  grid.centre_on({30, 70, n - 1});
  EXPECT_TRUE(has_all_round({30, 70, n - 1}));
}

// Some anchored regions are smaller than the cells of coarse levels. Others are larger, but their borders do
// not follow the coarse nodes.
TEST(CompositeGrid, PatchesWithAnchorsAnywhere) {
  using At = const Index3&;
  const auto cube = [](int x, int y, int z, int half) {
    return [=](At p) {
      return std::abs(p[0] - x) <= half && std::abs(p[1] - y) <= half && std::abs(p[2] - z) <= half;
    };
  };
  const auto from_bone = [](At p) { return std::hypot(p[0] - 30.0, p[1] - 30.0, p[2] - 20.0); };
  const auto outside_bone = [&](At p) { return from_bone(p) > 12.0; };
  const auto anchored_by = [](const std::function<bool(At)>& filled,
                              const std::function<bool(At)>& anchored) {
    const int n = 61;
    return patches_against_all(Body({n, n, n}, 0.9, filled, anchored), {{30, 30, n - 1}, 4, kSpacing}, 60);
  };
  EXPECT_LT(anchored_by(everywhere, [](At p) { return p[2] == 21; }), 0.03);
  EXPECT_LT(anchored_by(everywhere, [](At p) { return p[2] == 21 || p[0] == 3; }), 0.03);
  EXPECT_LT(anchored_by(everywhere, [](At p) { return p[2] < 10 + p[0] / 4; }), 0.05);
  EXPECT_LT(anchored_by(everywhere, [](At p) { return p[0] % 8 == 3 && p[1] % 8 == 3 && p[2] == 20; }), 0.05);
  EXPECT_LT(anchored_by(everywhere, [](At p) { return p[0] % 8 == 0 && p[1] % 8 == 0 && p[2] == 16; }), 0.05);
  EXPECT_LT(anchored_by(everywhere, [](At p) { return p[0] % 4 == 1 && p[1] % 4 == 1 && p[2] == 21; }), 0.05);
  EXPECT_LT(anchored_by(outside_bone, [&](At p) { return from_bone(p) < 13.5; }), 0.03);
  EXPECT_LT(anchored_by(outside_bone, [&](At p) { return p[0] < 30 && from_bone(p) < 13.5; }), 0.05);
  // For a single small region, most of the resistance is the constriction around it.
  for (const int half : {0, 1, 4, 8})
    EXPECT_LT(anchored_by(everywhere, cube(27, 34, 25, half)), 0.08) << half;
  EXPECT_LT(anchored_by(everywhere, cube(30, 30, 0, 1)), 0.08);
  EXPECT_LT(anchored_by(everywhere, cube(22, 37, 0, 2)), 0.13);
  EXPECT_LT(anchored_by(everywhere, cube(22, 37, 0, 4)), 0.08);
}

// The trial of an object also presses parts that are one voxel thick, which fill no coarse cell. The
// reference has all voxels on level 0. The force error at any voxel must be less than twice the error of the
// trial.
TEST(CompositeGrid, TheTrialFindsTheErrorOfThinParts) {
  constexpr int kDim = 40, kCycles = 60;
  constexpr double kDepth = 0.04 * kSpacing;
  constexpr double kScale = 0.1 * kDim * kSpacing / kDepth;  // scales a force to the trial's press
  constexpr double kLeast_N = 0.57;                          // errors are relative to this force at least
  using Filled = std::function<bool(const Index3&)>;
  const Filled fins = [](const Index3& p) { return p[2] < 20 || p[0] % 4 == 0; };
  const Filled rods = [](const Index3& p) { return p[2] < 24 || (p[0] % 6 == 3 && p[1] % 6 == 3); };
  const Filled shelf = [](const Index3& p) { return p[0] < 20 || p[2] == 30; };
  const Filled cells = [](const Index3& p) { return p[2] < 10 || p[0] % 5 == 0 || p[1] % 5 == 0; };
  for (const Filled& filled : {fins, rods, shelf, cells}) {
    const Body body({kDim, kDim, kDim}, 0.1, filled, below);
    const double said = CompositeGrid::suitability(*body.lattice).force_error;
    const auto pressed_N = [&](CompositeGrid grid, const Index3& at, const glm::dvec3& into) {
      grid.begin(at);
      for (int n = 0; n < kCycles; ++n) {
        grid.clear_pressed();
        grid.press(at, kDepth * into, into);
        grid.cycle();
      }
      return kScale * glm::length(grid.force_on_tool_N());
    };
    double worst = 0.0;
    for (const VoxelId v : body.lattice->surface()) {
      if (v % 1999 != 0) continue;
      const Index3 at = body.lattice->coordinates(v);
      if (at[2] == 0) continue;
      const glm::dvec3 outward = body.lattice->outward(v);
      const int axis = outward == glm::dvec3(0.0) ? 0 : CompositeGrid::largest_axis(outward);
      glm::dvec3 into(0.0);
      into[axis] = outward[axis] > 0.0 ? -1.0 : 1.0;
      const double felt_N = pressed_N(CompositeGrid(*body.lattice, 10), at, into),
                   true_N = pressed_N(CompositeGrid(*body.lattice, CompositeGrid::kRefineAll), at, into);
      worst = std::max(worst, std::fabs(felt_N - true_N) / std::max(true_N, kLeast_N));
    }
    EXPECT_LT(worst, 2.0 * said);
  }
}

TEST(CompositeGrid, SaysWhyAnObjectIsUnsuitable) {
  const Index3 dims{40, 40, 40};
  const auto reason = [](const Body& body) { return CompositeGrid::suitability(*body.lattice).reason; };
  EXPECT_EQ(reason(Body(dims, 0.1, everywhere, below)), "");
  const auto fins_of = [&](int tissue) {
    const auto fins = [](const Index3& p) { return p[2] < 20 || p[0] % 4 == 0; };
    return reason(Body(dims, 0.1, fins, below, [=](const Index3&) { return tissue; }));
  };
  EXPECT_EQ(fins_of(1), "");  // at 10 kPa no hand feels them
  EXPECT_THAT(fins_of(40), testing::HasSubstr("forces were"));
  const auto specks = [](const Index3& p) { return p[0] % 8 == 4 && p[1] % 8 == 4 && p[2] == 20; };
  EXPECT_EQ(reason(Body(dims, 0.1, everywhere, specks)), "");
  const auto lump = [](const Index3& p) { return p[0] > 10 && p[0] < 30 && p[1] > 10 && p[2] < 10; };
  EXPECT_EQ(reason(Body(dims, 0.1, everywhere, lump)), "");
  voxel::LatticeOptions two = made_of(slack(0.1));
  voxel::LabelVolume volume = block(dims, glm::dvec3(kSpacing));
  std::fill_n(volume.labels.begin(), 40 * 40 * 20, std::uint8_t{2});
  const auto reason_with = [&](const LinkMaterial& other) {
    two.materials[2] = other;
    return CompositeGrid::suitability(Lattice(volume, two)).reason;
  };
  LinkMaterial stiff = slack(0.1);
  stiff.young_Pa *= 5.0;
  EXPECT_EQ(reason_with(stiff), "");
  EXPECT_EQ(reason_with(slack(0.2)), "");
  stiff.poisson = 0.4;
  EXPECT_NE(reason_with(stiff), "");
  const auto skin = [](const Index3& p) { return p[2] == 39 ? 20 : 1; };
  EXPECT_EQ(reason(Body(dims, 0.1, everywhere, below, skin)), "");
}

}  // namespace
