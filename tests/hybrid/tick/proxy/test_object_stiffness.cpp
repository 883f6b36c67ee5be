// SPDX-License-Identifier: GPL-3.0-or-later
// Rigid objects with stiffnesses of their own. On each object the force is its stiffness times the depth.
// Where the tool touches two, or passes from one to the other, the force is continuous and gives no energy.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

#include "hybrid/feel/mixed_coupling.h"
#include "hybrid/session/tick_invariants.h"
#include "hybrid/world/edits.h"
#include "tests/hybrid/fixtures/feel_scene.h"

namespace {

using namespace tests;  // NOLINT(google-build-using-namespace): these tests use the whole fixture

constexpr double kSoft = 400.0, kStiff = 2500.0;  // N/m; the tool's is kToolStiffness
constexpr double kStep = 1e-5;                    // m, of the device in a tick
constexpr double kDepth = 2e-3;                   // m
constexpr double kSame_N = 1e-4;                  // a point tool is a ball of 1e-7 of the scene

RigidDescription block(const std::string& name, double stiffness_N_per_m, const dvec3& at) {
  RigidDescription box = rigid(name, hybrid::BoxPrimitive{dvec3(0.04)}, at);
  box.feel.stiffness_N_per_m = stiffness_N_per_m;
  return box;
}

// Two blocks side by side, with their tops at z = 0 and their seam at x = 0.
std::vector<RigidDescription> side_by_side() {
  return {block("soft", kSoft, {-0.02, 0, -0.02}), block("stiff", kStiff, {0.02, 0, -0.02})};
}
// A soft floor at z = 0 and a stiff wall at x = 0.
std::vector<RigidDescription> floor_and_wall() {
  return {block("floor", kSoft, {0.02, 0, -0.02}), block("wall", kStiff, {-0.02, 0, 0.0})};
}

class ObjectStiffness : public Feel, public ::testing::WithParamInterface<double> {
 protected:
  [[nodiscard]] double at_depth(double depth_m) const { return GetParam() - depth_m; }
};

TEST_P(ObjectStiffness, TheForceIsTheObjectsStiffnessTimesTheDepth) {
  std::vector<RigidDescription> blocks = side_by_side();
  blocks.push_back(block("as the tool", 0.0, {0.2, 0, -0.02}));
  Touch touch(scene_of(blocks, GetParam()), {0, 0, 0.05});
  const std::vector<std::pair<double, double>> places{{-0.02, kSoft}, {0.02, kStiff}, {0.2, kToolStiffness}};
  for (const auto& [x, stiffness] : places) {
    touch.go({x, 0, 0.02}, 1e-3);
    for (const double depth : {0.5e-3, kDepth, 1e-3}) {
      const TickResult felt = touch.go({x, 0, at_depth(depth)}, 1e-4);
      EXPECT_NEAR(felt.force_N.z, stiffness * depth, kSame_N) << x;
      EXPECT_NEAR(glm::length(felt.force_N), felt.force_N.z, 1e-9);
      EXPECT_NEAR(glm::length(felt.rigid_N - felt.coupling_N), 0.0, 1e-12) << "all of it is the object's";
    }
    touch.go({x, 0, 0.02}, 1e-3);
  }
}

TEST_P(ObjectStiffness, FrictionIsAShareOfTheObjectsOwnForce) {
  std::vector<RigidDescription> blocks = side_by_side();
  for (RigidDescription& b : blocks) b = rough(b);
  for (const double side : {-1.0, 1.0}) {
    Touch touch(scene_of(blocks, GetParam()), {0.02 * side, 0, 0.02});
    touch.go({0.02 * side, 0, at_depth(kDepth)}, 1e-4);
    const TickResult felt = touch.go({0.02 * side, 0.008, at_depth(kDepth)}, 1e-4);
    const double normal = (side < 0.0 ? kSoft : kStiff) * kDepth;
    EXPECT_NEAR(felt.force_N.z, normal, kSame_N);
    EXPECT_NEAR(-felt.force_N.y, kDynamic * normal, 1e-3 * normal);
  }
}

// Over the seam, and back: at the same place the force is the same again, because no energy was lost.
TEST_P(ObjectStiffness, BeyondASeamTheForceReturns) {
  Touch touch(scene_of(side_by_side(), GetParam()), {0, 0, 0.02});
  touch.go({0.01, 0, 0.02}, 1e-3);
  touch.go({0.01, 0, at_depth(kDepth)}, 1e-4);
  const TickResult soft = touch.go({-0.01, 0, at_depth(kDepth)}, 1e-4);
  EXPECT_NEAR(soft.force_N.z, kSoft * kDepth, kSame_N);
  const TickResult stiff = touch.go({0.01, 0, at_depth(kDepth)}, 1e-4);
  EXPECT_NEAR(stiff.force_N.z, kStiff * kDepth, kSame_N);
}

// From the soft block to the stiff one the hand has not given the energy for the whole force. The slope over
// depth is the stiff one's at once, and the whole force returns after the tool was lifted.
TEST_P(ObjectStiffness, AfterASeamTheSlopeIsThatOfTheStiffBlock) {
  Touch touch(scene_of(side_by_side(), GetParam()), {-0.01, 0, 0.02});
  touch.go({-0.01, 0, at_depth(kDepth)}, 1e-4);
  const TickResult over = touch.go({0.01, 0, at_depth(kDepth)}, 1e-4);
  EXPECT_NEAR(over.force_N.z, std::sqrt(kSoft * kStiff) * kDepth, 1e-3 * kStiff * kDepth);
  const TickResult deeper = touch.go({0.01, 0, at_depth(kDepth + 1e-3)}, 1e-4);
  EXPECT_NEAR(deeper.force_N.z - over.force_N.z, kStiff * 1e-3, 1e-3);
  touch.go({0.01, 0, 0.01}, 1e-4);
  const TickResult again = touch.go({0.01, 0, at_depth(kDepth)}, 1e-4);
  EXPECT_NEAR(again.force_N.z, kStiff * kDepth, kSame_N);
}

// Closed ways, across the seam and in the corner. A coupling that took each object's stiffness at once would
// give the hand up to ½ (2500 − 400) N/m (2 mm)² = 4.2 mJ at each passage.
TEST_P(ObjectStiffness, ClosedWaysGiveNothingAndTheForceIsContinuous) {
  const double deep = at_depth(kDepth), r = GetParam();
  struct Case {
    const char* name;
    std::vector<RigidDescription> blocks;
    std::function<dvec3(double)> at;
  };
  const std::vector<Case> cases{
      {"over the seam at one depth", side_by_side(),
       [=](double p) { return dvec3(4e-3 * wave(p), 0, deep); }},
      {"to the stiff block, back above", side_by_side(),
       [=](double p) { return dvec3(4e-3 * cowave(p), 0, r + 3e-3 * wave(p)); }},
      {"to the soft block, back above", side_by_side(),
       [=](double p) { return dvec3(4e-3 * cowave(p), 0, r - 3e-3 * wave(p)); }},
      {"deeper on the way to the stiff", side_by_side(),
       [=](double p) { return dvec3(4e-3 * cowave(p), 1e-3 * wave(p), deep + 1e-3 * wave(p)); }},
      {"deeper on the way to the soft", side_by_side(),
       [=](double p) { return dvec3(4e-3 * cowave(p), 1e-3 * wave(p), deep - 1e-3 * wave(p)); }},
      {"a circle in the corner", floor_and_wall(),
       [=](double p) { return dvec3(r + 2e-3 * cowave(p), 0, r + 2e-3 * wave(p)); }},
      {"the other way round", floor_and_wall(),
       [=](double p) { return dvec3(r + 2e-3 * cowave(p), 0, r - 2e-3 * wave(p)); }},
      {"deep in the corner", floor_and_wall(),
       [=](double p) { return dvec3(r - 2e-3 + 1e-3 * cowave(p), 0, r - 2e-3 + 1e-3 * wave(p)); }},
      {"deep, the other way round", floor_and_wall(),
       [=](double p) { return dvec3(r - 2e-3 + 1e-3 * cowave(p), 0, r - 2e-3 - 1e-3 * wave(p)); }}};
  for (const bool friction : {false, true}) {
    for (const Case& c : cases) {
      std::vector<RigidDescription> blocks = c.blocks;
      if (friction) {
        for (RigidDescription& b : blocks) b = rough(b);
      }
      Touch touch(scene_of(blocks, r), {5e-3, 0, 0.015});
      const Gain gain = closed_way(touch, {5e-3, 0, 0.01}, c.at, 3, kStep);
      std::printf("%-32s %s tool of %g mm: the hand gains %+.3g uJ; at most %.2f N\n", c.name,
                  friction ? "rough, " : "", 1e3 * r, 1e6 * gain.work_J, gain.most_N);
      EXPECT_LE(gain.work_J, 1e-6) << c.name;
      EXPECT_GT(gain.most_N, 0.5) << c.name;

      // The force follows the way with the stiffest slope, and the change of stiffness at its rate. On rough
      // surfaces it also steps where the proxy comes off.
      if (friction) continue;
      Touch again(scene_of(blocks, r), {5e-3, 0, 0.015});
      again.go({5e-3, 0, 0.01}, 1e-3);
      again.go(c.at(0.0), kStep);
      dvec3 before = again.at(c.at(0.0)).force_N;
      double step = 0.0, most = 0.0;
      for (int n = 1; n <= 4000; ++n) {
        const dvec3 to = c.at(n * 2.5e-4), from = again.state().device_m;
        const TickResult felt = again.at(to);
        const double depth = glm::length(felt.proxy_m - felt.device_m);
        const double change = 1e-3 / hybrid::kStiffnessChange_s * kStiff * depth;
        step = std::max(step, glm::length(felt.force_N - before));
        most = std::max(most, change + 2.0 * kStiff * glm::length(to - from));
        before = felt.force_N;
      }
      EXPECT_LE(step, most) << c.name;
    }
  }
}

// A random way of the device over soft, stiff and rough objects keeps the account of the hand's energy.
TEST_P(ObjectStiffness, RandomWaysKeepTheAccountOfEnergy) {
  std::vector<RigidDescription> blocks = side_by_side();
  blocks.push_back(block("ridge", 1500.0, {0, 0.025, -0.01}));
  blocks.push_back(block("as the tool", 0.0, {0, -0.025, -0.015}));
  std::mt19937 random(1);
  Touch touch(scene_of(blocks, GetParam()), {0, 0, 0.04});
  hybrid::TickInvariants watch(touch.world(), touch.state());
  const auto see = [&](const TickResult& felt) { watch.check_tick(touch.state(), felt, 1e-3); };
  for (int n = 0; n < 400; ++n) {
    const dvec3 to(between(random, -0.01, 0.01), between(random, -0.01, 0.01),
                   between(random, -0.006, 0.016));
    touch.go(to, between(random, 2e-5, 2e-3), 5, see);
  }
  touch.go({0, 0, 0.06}, 1e-3, 0, see);
  std::printf("tool of %g mm: %.3g mJ beyond the account, of %.3g mJ moved\n", 1e3 * GetParam(),
              1e3 * watch.excess_J(), 1e3 * watch.moved_J());
  EXPECT_EQ(watch.not_finite(), 0U);
  EXPECT_LE(watch.excess_J(), watch.tolerance_J());
  EXPECT_LE(watch.inside_m(), 2e-9);
}
INSTANTIATE_TEST_SUITE_P(Tools, ObjectStiffness, ::testing::Values(0.0, kRadius),
                         [](const auto& tool) { return tool.param > 0.0 ? "ABallOf2mm" : "APoint"; });

// Only an object that has a stiffness in the scene offers it for editing. A change while the object is
// pressed comes gradually; a softer coupling is felt whole.
TEST_F(Feel, AnObjectsStiffnessIsEdited) {
  std::vector<RigidDescription> blocks = side_by_side();
  blocks[0].feel.stiffness_N_per_m = 0.0;
  Touch touch(scene_of(blocks, kRadius), {0.02, 0, 0.02});
  using hybrid::EditedQuantity;
  const auto edit = [&](std::uint32_t object, double value) {
    return apply_edit(touch.world(), touch.state(),
                      {.object = object, .quantity = EditedQuantity::coupling_stiffness, .value = value});
  };
  EXPECT_FALSE(edit(0, 500.0));
  EXPECT_FALSE(edit(1, 0.0));
  const dvec3 deep(0.02, 0, kRadius - kDepth);
  touch.go(deep, 1e-4);
  ASSERT_TRUE(edit(1, 700.0));
  EXPECT_EQ(edited_value(touch.world(), touch.state(), 1, EditedQuantity::coupling_stiffness), 700.0);
  EXPECT_EQ(
      edited_value(touch.world(), touch.state(), hybrid::Edit::kTool, EditedQuantity::coupling_stiffness),
      kToolStiffness);
  const TickResult at_once = touch.at(deep);
  EXPECT_GT(at_once.force_N.z, 0.9 * kStiff * kDepth);
  EXPECT_NEAR(touch.go(deep, 1e-4, 60).force_N.z, 700.0 * kDepth, 1e-9);
  // Meanwhile the tool's was the stiffest: more energy than such a spring stores was not kept.
  ASSERT_TRUE(edit(1, kStiff));
  EXPECT_NEAR(touch.go(deep, 1e-4, 60).force_N.z, std::sqrt(kToolStiffness * kStiff) * kDepth, 1e-6);
  touch.go({0.02, 0, 0.02}, 1e-4);
  EXPECT_NEAR(touch.go(deep, 1e-4).force_N.z, kStiff * kDepth, kSame_N);
}

}  // namespace
