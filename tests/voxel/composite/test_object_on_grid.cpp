// SPDX-License-Identifier: GPL-3.0-or-later
// A SoftObject whose contact is solved on a CompositeGrid: its force, its energy and its visible dent.
#include <gtest/gtest.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <iostream>

#include "tests/voxel/composite/slack_material.h"
#include "tests/voxel/fixtures/soft_press.h"

namespace {

using tests::kSpacing;
using tests::slack;
using voxel::VoxelId;

struct Pressed {
  tests::SoftBlock block{{64, 64, 64}, kSpacing, slack(0.1)};
  bool on_grid = block.object->use_composite_grid(block.ball(8.0 * kSpacing, 0.0), 6).empty();

  voxel::Reaction to(double depth, int ticks) {
    const voxel::ToolInBody tool = block.ball(8.0 * kSpacing, depth * kSpacing);
    voxel::Reaction felt;
    for (int n = 0; n < ticks; ++n) {
      block.touch(tool, 12.0 * kSpacing);
      block.object->push_out(tool);
      block.object->relax_near(tool, 1);
      felt = block.object->reaction(tool);
    }
    return felt;
  }
};

TEST(ObjectOnGrid, FeelsTheLatticeAtEquilibriumThatAnchorsCarry) {
  Pressed pressed;
  ASSERT_TRUE(pressed.on_grid);
  tests::SoftBlock lattice({64, 64, 64}, kSpacing, slack(0.1));
  for (const double depth : {1.0, 2.0, 3.0}) {
    const double felt = pressed.to(depth, 40).force_N.z;
    const double right =
        lattice.press(lattice.ball(8.0 * kSpacing, depth * kSpacing), 12.0 * kSpacing).force_N.z;
    const auto carried = lattice.object->carried_by_anchors_N();
    ASSERT_TRUE(carried.has_value());
    EXPECT_NEAR(-carried->z, right, 0.01 * right);
    std::cout << "[ measured ] depth " << depth << ": " << 100.0 * (felt / right - 1.0) << " %\n";
    EXPECT_NEAR(felt, right, 0.035 * right) << depth;
  }
}

// The tool moves by half a spacing per tick, inwards and outwards. The force must match the tool's present
// place, not an earlier one.
TEST(ObjectOnGrid, AMovingToolFeelsTheForceOfWhereItIs) {
  Pressed pressed;
  ASSERT_TRUE(pressed.on_grid);
  for (const double way : {1.0, -1.0}) {
    const double from = way > 0.0 ? 1.0 : 4.0;
    pressed.to(from, 60);
    for (int n = 1; n <= 4; ++n) pressed.to(from + 0.5 * way * n, 1);
    const double to = from + 2.0 * way, moving = pressed.to(to + 0.5 * way, 1).force_N.z;
    const double right = pressed.to(to + 0.5 * way, 60).force_N.z;
    std::cout << "[ measured ] " << moving << " N moving, at rest " << right << " N\n";
    EXPECT_NEAR(moving, right, std::max(0.07 * right, 0.03));  // the just noticeable difference
  }
}

TEST(ObjectOnGrid, ShowsItsDentAndKeepsItsState) {
  Pressed pressed;
  ASSERT_TRUE(pressed.on_grid);
  pressed.to(3.0, 20);
  const voxel::SoftObject& object = *pressed.block.object;
  const glm::dvec2 middle = pressed.block.middle();
  const glm::dvec3 top(middle, pressed.block.top());
  EXPECT_NEAR(object.displacement_at(top).z, -3.0 * kSpacing, 0.1 * kSpacing);
  const VoxelId v = pressed.block.lattice->at(32, 32, 63);
  EXPECT_NEAR(object.displacement(v).z, -3.0 * kSpacing, 0.1 * kSpacing);
  EXPECT_GT(object.energy_J(), 0.0);
  const auto copy = object.copy();
  EXPECT_EQ(copy->displacement(v), object.displacement(v));
  for (const auto& axis : object.state().u) {
    EXPECT_TRUE(std::all_of(axis.begin(), axis.end(), [](float u) { return u == 0.0F; }));
  }
  pressed.block.object->touch({});
  EXPECT_EQ(object.displacement(v), glm::dvec3(0.0));
  EXPECT_EQ(object.energy_J(), 0.0);
}

// The force is the derivative of the energy, so that the object returns the work done on it.
TEST(ObjectOnGrid, StoresWhatIsGiven) {
  Pressed pressed;
  ASSERT_TRUE(pressed.on_grid);
  const double step = 0.1, below = pressed.to(2.0 - step, 60).force_N.z;
  const double stored = pressed.block.object->energy_J();
  const double force = pressed.to(2.0, 60).force_N.z;
  const double above = pressed.to(2.0 + step, 60).force_N.z;
  const double given = step * kSpacing * (0.5 * below + force + 0.5 * above);
  EXPECT_NEAR(pressed.block.object->energy_J() - stored, given, 0.06 * given);
}

}  // namespace
