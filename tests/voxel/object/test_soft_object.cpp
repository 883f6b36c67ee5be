// SPDX-License-Identifier: GPL-3.0-or-later
// The reaction against its definition, the derivative of the minimised energy with respect to the tool's
// place.
#include "voxel/object/soft_object.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>

#include "tests/voxel/fixtures/soft_press.h"

namespace {

using tests::elastic;
using tests::SoftBlock;
using voxel::LinkMaterial;
using voxel::Reaction;
using voxel::ToolBound;
using voxel::ToolInBody;
using voxel::VoxelId;

constexpr double kH = 1e-3;  // spacing of the blocks below (m)
constexpr LinkMaterial kFirm{
    .young_Pa = 1e4, .poisson = 0.3, .stretch_min = 0.9, .stretch_max = 1.1, .shear = 0.1};

// dE/d(depth) by a central difference (N). Afterwards the object is pressed to `depth + step`.
double energy_slope(SoftBlock& soft, double radius, double depth, double step, double range) {
  soft.press(soft.ball(radius, depth - step), range);
  const double less = soft.object->energy_J();
  soft.press(soft.ball(radius, depth + step), range);
  return (soft.object->energy_J() - less) / (2 * step);
}

TEST(SoftObject, ReactionIsTheDerivativeOfTheMinimisedEnergy) {
  SoftBlock soft({31, 31, 21}, kH, elastic(1e4, 0.3));
  for (const double depth : {0.5, 1.0, 2.0, 3.0}) {
    const Reaction felt = soft.press(soft.ball(6 * kH, depth * kH), 9 * kH);
    EXPECT_TRUE(soft.settled);
    std::cout << soft.object->relaxation().cycles() << " cycles so far; ";
    const double force = felt.force_N.z;
    const double slope = energy_slope(soft, 6 * kH, depth * kH, 0.02 * kH, 9 * kH);
    std::cout << "depth " << depth << " spacings: reaction " << force << " N, slope of the energy " << slope
              << " N (" << 100 * (force / slope - 1) << " %), " << felt.pressed << " voxels\n";
    EXPECT_NEAR(force, slope, 0.02 * slope);
    // Ball and block are symmetric, and the contact has no friction.
    EXPECT_LT(glm::length(glm::dvec2(felt.force_N)), 1e-3 * force);
  }
}

TEST(SoftObject, TheTightChainIsFelt) {
  // With links at their limits the force continues to grow, because the loads of dependent voxels are felt
  // too.
  SoftBlock soft({21, 21, 15}, kH, kFirm);
  double before = 0.0, worst = 0.0;
  for (const double depth : {0.2, 0.4, 0.6, 0.8, 1.0}) {
    const double force = soft.press(soft.ball(5 * kH, depth * kH), 8 * kH).force_N.z;
    SoftBlock other({21, 21, 15}, kH, kFirm);
    const double slope = energy_slope(other, 5 * kH, depth * kH, 0.02 * kH, 8 * kH);
    std::cout << "depth " << depth << " spacings: reaction " << force << " N, slope of the energy " << slope
              << " N (" << 100 * (force / slope - 1) << " %)\n";
    EXPECT_GT(force, before);
    EXPECT_NEAR(force, slope, 0.1 * slope) << depth;
    before = force;
    worst = std::max(worst, std::fabs(force / slope - 1));
  }
  std::cout << "largest difference " << 100 * worst << " %\n";
}

// At rest, the anchors carry the felt force. After a single cycle the object is not at rest, and the forces
// differ.
TEST(SoftObject, AnchorsCarryWhatIsFelt) {
  for (const LinkMaterial& material : {elastic(1e4, 0.3), kFirm}) {
    SoftBlock soft({25, 25, 17}, kH, material);
    const double range = 8 * kH;
    for (const double depth : {0.3, 0.6}) {
      const double felt = soft.press(soft.ball(5 * kH, depth * kH), range).force_N.z;
      const auto carried = soft.object->carried_by_anchors_N();
      ASSERT_TRUE(carried.has_value());
      EXPECT_NEAR(-carried->z, felt, 5e-3 * felt) << depth;
      EXPECT_LT(glm::length(glm::dvec2(*carried)), 1e-3 * felt);
    }
    const double on_its_way = soft.press(soft.ball(5 * kH, 1.2 * kH), range, 0.0, 1).force_N.z;
    const auto carried = soft.object->carried_by_anchors_N();
    ASSERT_TRUE(carried.has_value());
    EXPECT_GT(std::abs(on_its_way + carried->z), 0.05 * on_its_way);
  }
}

// If an anchor's link is at its limit, it carries more than its spring force. Then the force on the anchors
// is not reported.
TEST(SoftObject, WhatTightAnchorsCarryIsNotSaid) {
  SoftBlock soft({15, 15, 3}, kH, kFirm);
  soft.press(soft.ball(4 * kH, 0.6 * kH), 8 * kH);
  EXPECT_FALSE(soft.object->carried_by_anchors_N().has_value());
}

TEST(SoftObject, NoWorkIsDoneAroundAClosedPath) {
  SoftBlock soft({27, 27, 17}, kH, elastic(1e4, 0.3));
  const double side = 1.0 * kH;
  const int steps = 16;
  // The path is not centred and not aligned with the lattice, so that no error cancels by symmetry.
  const glm::dvec3 corner = soft.ball(5 * kH, 1.2 * kH).centre + glm::dvec3(1.3, 0.4, 0.0) * kH;
  ToolInBody tool = soft.ball(5 * kH, 0.0);
  const auto felt_at = [&](const glm::dvec3& place) {
    tool.centre = place;
    return soft.press(tool, 9 * kH).force_N;
  };
  const glm::dvec3 ways[] = {{side, 0, 0}, {0, 0, -side}, {-side, 0, 0}, {0, 0, side}};
  glm::dvec3 place = corner, before = felt_at(corner);
  const glm::dvec3 first = before;
  double work = 0.0, exchanged = 0.0;
  for (const glm::dvec3& way : ways) {
    for (int n = 0; n < steps; ++n) {
      place += way / static_cast<double>(steps);
      const glm::dvec3 felt = felt_at(place);
      const double part = glm::dot(0.5 * (before + felt), way / static_cast<double>(steps));
      work += part;
      exchanged += std::fabs(part);
      before = felt;
    }
  }
  std::cout << "work around the path " << work << " J of " << exchanged << " J exchanged ("
            << work / exchanged << "); force at its end differs by "
            << glm::length(before - first) / glm::length(first) << "\n";
  EXPECT_LT(std::fabs(work), 1e-3 * exchanged);
  EXPECT_LT(glm::length(before - first), 1e-3 * glm::length(first));
}

TEST(SoftObject, ForgetsAToolThatLeft) {
  SoftBlock soft({41, 41, 31}, kH, elastic(1e4, 0.3));
  soft.press(soft.ball(8 * kH, 3 * kH), 12 * kH);
  const auto largest = [&] {
    double most = 0.0;
    for (const VoxelId v : soft.lattice->surface())
      most = std::max(most, glm::length(soft.object->state().at(v)));
    return most;
  };
  const double start = largest();
  EXPECT_NEAR(start, 3 * kH, 0.1 * kH);
  soft.object->touch({});
  // The background relaxation needs no extra call to wake it.
  int cycles = 0;
  const auto& relaxation = soft.object->relaxation();
  for (const auto first = relaxation.cycles(); largest() > 0.01 * start && cycles < 200;) {
    soft.object->relax_background(5000);
    if (soft.object->asleep()) break;
    cycles = static_cast<int>(relaxation.cycles() - first);
  }
  std::cout << "below 1 % of its depth after " << cycles << " cycles\n";
  EXPECT_LE(largest(), 0.01 * start);
  EXPECT_LE(cycles, 20);
}

TEST(SoftObject, WhatCannotGoFurtherPushesTheToolOut) {
  // Five layers of links shorten by a tenth of a spacing each, which is half a spacing in total.
  SoftBlock soft({9, 9, 6}, kH, kFirm);
  ToolInBody tool = soft.ball(3 * kH, 2 * kH);
  std::array<ToolBound, 256> bounds;
  soft.touch(tool, 6 * kH);
  EXPECT_TRUE(soft.object->push_out(tool));
  ASSERT_GT(soft.object->give_way(tool, bounds), 0U);
  const double deepest = tool.centre.z;
  int turns = 0;
  for (; turns < 100; ++turns) {
    soft.object->push_out(tool);
    soft.object->relax_near(tool, 2);
    const std::size_t count = soft.object->give_way(tool, bounds);
    if (count == 0) break;
    for (std::size_t i = 0; i < count; ++i) {
      const ToolBound& b = bounds[i];
      EXPECT_NEAR(glm::length(b.normal), 1.0, 1e-9);
      const double missing = b.offset - glm::dot(b.normal, tool.centre);
      if (missing > 0.0) tool.centre += missing * b.normal;
    }
    soft.touch(tool, 6 * kH);
  }
  EXPECT_LT(turns, 100);
  const double depth = soft.ball(3 * kH, 0.0).centre.z - tool.centre.z;
  std::cout << "out by " << (tool.centre.z - deepest) / kH << " spacings in " << turns
            << " turns, to a depth of " << depth / kH << "\n";
  EXPECT_LE(depth, 0.51 * kH);  // give_way() leaves a hundredth of a voxel to the next push_out()
  EXPECT_GE(depth, 0.1 * kH);
  EXPECT_LE(voxel::worst_violation(*soft.lattice, soft.object->state()), 1e-9);
}

TEST(SoftObject, WhatIsTiedToAnchorsIsHeldFast) {
  SoftBlock soft({9, 9, 6}, kH, kFirm);
  const VoxelId v = soft.lattice->at(4, 4, 5);
  const glm::dvec3 down(0.1, 0.0, -1.0), up(0.0, 0.1, 1.0);
  EXPECT_FALSE(soft.object->is_immovable(v, down));
  ToolInBody tool = soft.ball(3 * kH, 2 * kH);  // four times the depth that five links of a tenth allow
  soft.touch(tool, 6 * kH);
  soft.object->push_out(tool);
  EXPECT_TRUE(soft.object->is_immovable(v, down));
  EXPECT_FALSE(soft.object->is_immovable(v, up));
  EXPECT_TRUE(soft.object->is_immovable(soft.lattice->at(0, 0, 0), up));  // an anchor
}

TEST(SoftObject, NoToolSlipsBetweenVoxels) {
  for (const double radius : {0.01, 0.2, 0.4, 0.6, 0.8, 1.0}) {
    SoftBlock soft({11, 11, 8}, kH, {.young_Pa = 1e4});
    ToolInBody tool = soft.ball(radius * kH, 0.0);
    // over the middle of four voxels, where the gap is widest
    tool.centre.x += 0.5 * kH;
    tool.centre.y += 0.5 * kH;
    const double start = soft.top() + soft.object->reach(radius * kH);
    double most = 0.0, depth = 0.0, lost = -1.0;
    for (; depth <= 3.0 && lost < 0.0; depth += 0.05) {
      tool.centre.z = start - depth * kH;
      soft.touch(tool, 4 * kH);
      soft.object->settle(tool, 1e-4 * soft.lattice->force_scale_N(), 100);
      const double force = soft.object->reaction(tool).force_N.z;
      // A force far below the largest one so far means that the tool slipped between the voxels.
      if (force < 0.8 * most) lost = depth;
      most = std::max(most, force);
    }
    std::cout << "radius " << radius << " spacings: " << most << " N at most, ";
    if (lost < 0.0) {
      std::cout << "held down to a depth of 3 spacings\n";
    } else {
      std::cout << "lost at a depth of " << lost << " spacings\n";
    }
    EXPECT_LT(lost, 0.0) << "radius " << radius;
    EXPECT_GT(most, 0.0);
  }
}

TEST(SoftObject, ABlockThatNobodyTouchesIsStill) {
  SoftBlock soft({5, 5, 5}, kH, elastic(1e4, 0.3));
  const ToolInBody tool = soft.ball(2 * kH, -0.1 * kH);
  soft.touch(tool, 4 * kH);
  EXPECT_FALSE(soft.object->push_out(tool));
  const Reaction felt = soft.object->reaction(tool);
  EXPECT_EQ(felt.pressed, 0U);
  EXPECT_EQ(felt.force_N, glm::dvec3(0.0));
  EXPECT_FALSE(soft.object->moved_ever());
  EXPECT_EQ(soft.object->relax_background(1000), 0U);
  EXPECT_EQ(soft.object->energy_J(), 0.0);
  EXPECT_EQ(soft.object->displacement_at({0.002, 0.002, 0.002}), glm::dvec3(0.0));
}

TEST(SoftObject, ACopyGoesOnAsItsOriginal) {
  SoftBlock soft({15, 15, 9}, kH, {.young_Pa = 1e4});
  soft.press(soft.ball(4 * kH, kH), 6 * kH);
  const auto copy = soft.object->copy();
  const ToolInBody deeper = soft.ball(4 * kH, 1.5 * kH);
  soft.object->settle(deeper, 1e-5 * soft.lattice->force_scale_N(), 300);
  copy->settle(deeper, 1e-5 * soft.lattice->force_scale_N(), 300);
  const double a = soft.object->reaction(deeper).force_N.z, b = copy->reaction(deeper).force_N.z;
  EXPECT_NEAR(a, b, 1e-3 * a);
}

}  // namespace
