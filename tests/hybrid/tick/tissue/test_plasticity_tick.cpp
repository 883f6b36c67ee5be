// SPDX-License-Identifier: GPL-3.0-or-later
// A scene with plastic tissue. A deep press leaves a dent, which is equal in each run and can be felt.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <glm/geometric.hpp>
#include <string>

#include "tests/hybrid/fixtures/touch.h"
#include "voxel/relaxation/relaxation.h"

namespace {

using glm::dvec3;
using tests::coupling;
using tests::Touch;

class YieldTick : public tests::SceneFile {
 protected:
  hybrid::Scene block_with(const std::string& material) const {
    return load("format = 1\n[tool]\nradius = 6\nstiffness = 1000\n" + tests::unlimited +
                "[material.dough]\nyoung = 8000\npoisson = 0.3\n" + material +
                "[[soft]]\nname = \"block\"\nformula = \"block\"\nsize = [48, 48, 24]\nspacing = 2\n"
                "position = [0, 0, -12]\nmaterial = \"dough\"\n" +
                tests::some_path);
  }
};

constexpr dvec3 kAbove(0.0, 0.0, 0.02);
constexpr double kTouchedAt = 6e-3;  // height of the tool's centre when it touches the block

// Presses the tool to a depth, holds it there, takes it away and waits. Returns the force while held (N).
double press_and_leave(Touch& touch, double depth_m) {
  const double force = coupling(touch.go({0, 0, kTouchedAt - depth_m}, 4e-5, 1000)).z;
  touch.go(kAbove, 1e-4, 2000);
  return force;
}

double deepest_m(Touch& touch) {
  const voxel::SoftObject& soft = *touch.state().soft[0];
  double least = 0.0;
  for (const voxel::VoxelId v : soft.lattice().surface()) least = std::min(least, soft.state().at(v).z);
  return -least;
}

TEST_F(YieldTick, ABlockKeepsItsDentAndTheToolFeelsIt) {
  const double depth = 6e-3;
  Touch dough(block_with("yield = 0.1\n"), kAbove), spring(block_with(""), kAbove);
  const double pressed = press_and_leave(dough, depth), elastic = press_and_leave(spring, depth);
  const double dent = deepest_m(dough);
  std::printf("pressed 6 mm: %.4f N (elastic %.4f N), a dent of %.2f mm stays (elastic %.4f mm)\n", pressed,
              elastic, 1e3 * dent, 1e3 * deepest_m(spring));
  EXPECT_LT(pressed, elastic);
  EXPECT_GT(dent, 0.2 * depth);
  EXPECT_LT(dent, depth);
  EXPECT_LT(deepest_m(spring), 0.01 * depth) << "what does not yield has none";
  // The dent is empty, so a tool in its upper half touches nothing.
  const dvec3 in_the_dent(0.0, 0.0, kTouchedAt - 0.5 * dent);
  EXPECT_EQ(coupling(dough.go(in_the_dent, 4e-5, 100)), dvec3(0.0));
  EXPECT_GT(coupling(spring.go(in_the_dent, 4e-5, 100)).z, 0.0);
  // Below the dent the tool does touch tissue. A press less deep than the first one leaves the dent
  // unchanged.
  EXPECT_GT(press_and_leave(dough, 0.5 * (dent + depth)), 0.0);
  EXPECT_NEAR(deepest_m(dough), dent, 0.02 * dent);
}

TEST_F(YieldTick, TheDentIsTheSameInEachRun) {
  const hybrid::Scene scene = block_with("yield = 0.1\n");
  Touch first(scene, kAbove), second(scene, kAbove);
  EXPECT_EQ(press_and_leave(first, 5e-3), press_and_leave(second, 5e-3));
  const voxel::SoftObject &a = *first.state().soft[0], &b = *second.state().soft[0];
  std::size_t moved = 0;
  for (std::size_t i = 0; i < a.lattice().size(); ++i) {
    const auto v = static_cast<voxel::VoxelId>(i);
    if (!a.lattice().filled(v)) continue;
    ASSERT_EQ(a.state().at(v), b.state().at(v));
    moved += a.state().at(v) != dvec3(0.0) ? 1 : 0;
  }
  EXPECT_GT(moved, 100U);
}

}  // namespace
