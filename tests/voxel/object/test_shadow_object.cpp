// SPDX-License-Identifier: GPL-3.0-or-later
// Asynchronous relaxation reaches the same equilibrium, never raises the energy, and violates no limit,
// whatever the tick does meanwhile.
#include "voxel/object/shadow_object.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "tests/voxel/fixtures/soft_press.h"
#include "voxel/object/validate.h"

namespace {

using tests::elastic;
using tests::SoftBlock;
using voxel::LinkMaterial;
using voxel::ShadowObject;
using voxel::ToolInBody;

constexpr double kH = 1e-3;  // spacing (m)
constexpr LinkMaterial kFirm{
    .young_Pa = 1e4, .poisson = 0.3, .stretch_min = 0.9, .stretch_max = 1.1, .shear = 0.1};

// Bound on the violation of limits, in float roundings of the largest displacement. The chain tolerates 3.5
// roundings, so that no wave starts because of rounding. The limit and both ends of its link are rounded once
// each. In 25 sequences of 400 ticks, the largest violation was 5 roundings. It came from the chain and did
// not grow.
constexpr double kRoundings = 6.0;

// One exchange with the shadow, which applies `rows` far rows per tick.
void exchange(ShadowObject& shadow, SoftBlock& soft, std::size_t rows) {
  shadow.submit(*soft.object);
  shadow.relax();
  shadow.apply_near(*soft.object);
  while (!shadow.all_applied()) shadow.apply_far(*soft.object, rows);
}

void press_and_let_go(ShadowObject& shadow, SoftBlock& soft) {
  const ToolInBody tool = soft.ball(6 * kH, 3 * kH);
  soft.touch(tool, 9 * kH);
  for (int n = 0; n < 10; ++n) {
    soft.object->push_out(tool);
    soft.object->relax_near(tool, 1);
    exchange(shadow, soft, 1000);
  }
  soft.object->touch({});
}

double largest_difference(const voxel::SoftObject& a, const voxel::SoftObject& b) {
  double most = 0.0;
  for (voxel::VoxelId v = 0; v < a.lattice().size(); ++v) {
    if (a.lattice().filled(v)) most = std::max(most, glm::distance(a.state().at(v), b.state().at(v)));
  }
  return most;
}

TEST(ShadowObject, AHeldContactComesToTheSameRest) {
  for (const LinkMaterial& material : {elastic(1e4, 0.3), kFirm}) {
    SoftBlock apart({41, 37, 25}, kH, material), there({41, 37, 25}, kH, material);
    const ToolInBody tool = apart.ball(6 * kH, 1.5 * kH);
    const voxel::Reaction wanted = there.press(tool, 9 * kH, 1e-5, 2000);
    ShadowObject shadow(*apart.object);
    apart.touch(tool, 9 * kH);
    voxel::Reaction felt;
    for (int n = 0; n < 60; ++n) {
      apart.object->push_out(tool);
      apart.object->relax_near(tool, 1);
      felt = apart.object->reaction(tool);
      exchange(shadow, apart, 333);
    }
    EXPECT_NEAR(felt.force_N.z, wanted.force_N.z, 2e-3 * wanted.force_N.z);
    EXPECT_LT(largest_difference(*apart.object, *there.object), 0.02 * kH);
    EXPECT_EQ(voxel::validate(*apart.lattice, apart.object->state(), kRoundings), "");
  }
}

// The contact stays at rest for any number of exchanges. The tick and the shadow each relax a part of the
// motion, and must not both apply the same part.
TEST(ShadowObject, AHeldContactStaysAtRest) {
  SoftBlock soft({41, 37, 25}, kH, kFirm);
  ShadowObject shadow(*soft.object);
  const ToolInBody tool = soft.ball(6 * kH, 2 * kH);
  std::vector<double> felt;
  for (int n = 0; n < 400; ++n) {
    for (int tick = 0; tick < 2; ++tick) {
      soft.touch(tool, 9 * kH);
      soft.object->push_out(tool);
      soft.object->relax_near(tool, 1);
      felt.push_back(soft.object->reaction(tool).force_N.z);
      if (tick == 0) {
        shadow.submit(*soft.object);
        shadow.relax();
      }
    }
    shadow.apply_near(*soft.object);
    while (!shadow.all_applied()) shadow.apply_far(*soft.object, 250);
  }
  const auto [low, high] = std::minmax_element(felt.begin() + 200, felt.end());
  EXPECT_LT(*high - *low, 1e-3 * felt.back());
}

// A result is applied in parts while the tool is still. The force changes in even steps, because relaxation
// finds no residual in between. The final force is the same as after a single step. The depth is so small
// that no limit is active, because under active limits the result depends on the steps.
TEST(ShadowObject, AResultInPartsIsFeltInEvenSteps) {
  constexpr int parts = 8;
  SoftBlock whole({41, 37, 25}, kH, elastic(1e4, 0.3)), some({41, 37, 25}, kH, elastic(1e4, 0.3));
  const ToolInBody tool = whole.ball(6 * kH, 0.3 * kH);
  const auto feel = [&](SoftBlock& soft) {
    soft.object->push_out(tool);
    soft.object->relax_near(tool, 1);
    return soft.object->reaction(tool).force_N.z;
  };
  ShadowObject of_whole(*whole.object), of_some(*some.object);
  double before = 0.0, after = 0.0;
  std::vector<double> felt;
  for (SoftBlock* soft : {&whole, &some}) {
    ShadowObject& shadow = soft == &whole ? of_whole : of_some;
    soft->touch(tool, 9 * kH);
    before = feel(*soft);
    shadow.submit(*soft->object);
    shadow.relax();
    shadow.apply_near(*soft->object, soft == &whole ? 1 : parts);
    EXPECT_EQ(shadow.in_parts(), soft == &some);
    for (int n = 1; n < parts && soft == &some; ++n) {
      EXPECT_FALSE(shadow.all_applied());
      felt.push_back(feel(*soft));
      shadow.apply_part(*soft->object, false);
    }
    EXPECT_FALSE(shadow.in_parts());
    while (!shadow.all_applied()) shadow.apply_far(*soft->object, 1000);
    const double now = feel(*soft);
    if (soft == &whole) after = now;
    felt.push_back(now);
  }
  felt.erase(felt.begin());  // the force after the result that was applied at once
  const double step = (after - before) / parts;
  ASSERT_EQ(felt.size(), static_cast<std::size_t>(parts));
  EXPECT_LT(after, 0.99 * before) << "a result that changes something";
  for (std::size_t n = 0; n < felt.size(); ++n)
    EXPECT_NEAR(felt[n], before + step * static_cast<double>(n + 1), 0.5 * std::fabs(step)) << n;
  EXPECT_LT(largest_difference(*whole.object, *some.object), 0.01 * kH);
}

// If the tool moves, the remaining parts of a result are applied at once, so that the whole result is
// applied.
TEST(ShadowObject, AResultInPartsThatIsCutShortHasComeWhole) {
  SoftBlock whole({41, 37, 25}, kH, elastic(1e4, 0.3)), some({41, 37, 25}, kH, elastic(1e4, 0.3));
  for (SoftBlock* soft : {&whole, &some}) {
    const ToolInBody tool = soft->ball(6 * kH, 0.3 * kH);
    ShadowObject shadow(*soft->object);
    soft->touch(tool, 9 * kH);
    soft->object->push_out(tool);
    soft->object->relax_near(tool, 1);
    shadow.submit(*soft->object);
    shadow.relax();
    shadow.apply_near(*soft->object, soft == &whole ? 1 : 8);
    if (soft == &some) {
      shadow.apply_part(*soft->object, false);
      shadow.apply_part(*soft->object, true);
    }
    EXPECT_FALSE(shadow.in_parts());
    while (!shadow.all_applied()) shadow.apply_far(*soft->object, 1000);
  }
  EXPECT_LT(largest_difference(*whole.object, *some.object), 1e-5 * kH);
}

TEST(ShadowObject, WhatTheToolLeftComesToRestAndIsLeftAlone) {
  SoftBlock soft({41, 37, 25}, kH, elastic(1e4, 0.3));
  ShadowObject shadow(*soft.object);
  press_and_let_go(shadow, soft);
  int exchanges = 0;
  for (; exchanges < 200 && ShadowObject::wanted(*soft.object); ++exchanges) exchange(shadow, soft, 1000);
  EXPECT_LT(exchanges, 60);
  double most = 0.0;
  for (voxel::VoxelId v = 0; v < soft.lattice->size(); ++v)
    most = std::max(most, glm::length(soft.object->state().at(v)));
  EXPECT_LT(most, 1e-3 * kH);
}

// Presses ten spacings deep, in steps without a cycle between them, as after a jump of the tool. All links
// that moved are at their limits, and their voxels are spacings away from equilibrium.
ToolInBody press_at_once(SoftBlock& soft) {
  ToolInBody tool;
  constexpr int steps = 40;
  for (int n = 1; n <= steps; ++n) {
    tool = soft.ball(10 * kH, 10 * kH * n / steps);
    soft.touch(tool, 13 * kH);
    if (n > 1) soft.object->follow({0.0, 0.0, -10 * kH / steps});
    soft.object->push_out(tool);
  }
  return tool;
}

constexpr std::array<int, 3> kWide{75, 73, 57};
constexpr LinkMaterial kLoose{.stretch_min = 0.05, .stretch_max = 10.0, .shear = 10.0};

TEST(ShadowObject, AJumpIsFeltRightAfterThreeResults) {
  for (const LinkMaterial& material : {LinkMaterial{}, kLoose}) {
    SoftBlock soft(kWide, kH, material), there(kWide, kH, material);
    ShadowObject shadow(*soft.object);
    const ToolInBody tool = press_at_once(soft);
    const double wanted = there.press(tool, 13 * kH, 1e-5, 200).force_N.z;
    for (int n = 0; n < 3; ++n) {
      soft.object->relax_near(tool, 2);
      exchange(shadow, soft, 250);
      soft.touch(tool, 13 * kH);
      soft.object->push_out(tool);
    }
    soft.object->relax_near(tool, 2);
    EXPECT_NEAR(soft.object->reaction(tool).force_N.z, wanted, 0.05 * wanted);
    EXPECT_EQ(voxel::validate(*soft.lattice, soft.object->state(), kRoundings), "");
  }
}

// A result moves rows by whole spacings. No row can move before its neighbours, but all rows reach their
// places.
TEST(ShadowObject, WhatMovesFarIsAddedWhole) {
  for (const LinkMaterial& material : {LinkMaterial{}, kLoose}) {
    SoftBlock soft(kWide, kH, material);
    ShadowObject shadow(*soft.object);
    const ToolInBody tool = press_at_once(soft);
    soft.object->relax_near(tool, 2);
    exchange(shadow, soft, 250);
    std::size_t moved = 0, behind = 0;
    for (voxel::VoxelId v = 0; v < soft.lattice->size(); ++v) {
      if (!soft.lattice->filled(v)) continue;
      const glm::dvec3 here = soft.object->state().at(v),
                       there = shadow.displacement_at(soft.lattice->rest(v));
      moved += glm::length(there) > 0.1 * kH ? 1 : 0;
      behind += glm::distance(here, there) > 0.1 * kH ? 1 : 0;
    }
    EXPECT_GT(moved, 50'000U);
    EXPECT_LT(behind, moved / 100);
  }
}

// Small changes far from the contact are deferred. At rest, the object and its shadow have the same state.
TEST(ShadowObject, DeferredChangesArePassedOnAtRest) {
  SoftBlock soft({41, 65, 65}, kH, elastic(1e4, 0.3));
  ShadowObject shadow(*soft.object);
  const ToolInBody tool = soft.ball(6 * kH, 2 * kH);
  soft.touch(tool, 9 * kH);
  soft.object->push_out(tool);
  for (int n = 0; n < 300 && ShadowObject::wanted(*soft.object); ++n) exchange(shadow, soft, 1000);
  ASSERT_FALSE(ShadowObject::wanted(*soft.object));
  double most = 0.0;
  for (voxel::VoxelId v = 0; v < soft.lattice->size(); ++v) {
    if (!soft.lattice->filled(v)) continue;
    const glm::dvec3 known = shadow.displacement_at(soft.lattice->rest(v));
    most = std::max(most, glm::distance(soft.object->state().at(v), known));
  }
  EXPECT_LT(most, voxel::kRestingResidual * kH);
}

// Applying a result takes longer than the time until the next submission. Rows that a tick moves meanwhile
// are submitted together with their pending motion. This motion must not be applied twice. The block is
// released and comes to rest.
TEST(ShadowObject, RowsSubmittedWhileAResultIsAppliedMoveOnce) {
  SoftBlock soft({41, 37, 25}, kH, elastic(1e4, 0.3));
  ShadowObject shadow(*soft.object);
  press_and_let_go(shadow, soft);
  const double first = soft.object->energy_J();
  // A move by 0 marks the row dirty, so that it is submitted each time.
  const voxel::VoxelId dirty = soft.lattice->grid().at(20, 18, 12);
  for (int n = 0; n < 40; ++n) {
    shadow.submit(*soft.object);
    shadow.relax();
    while (!shadow.all_applied()) {
      shadow.apply_far(*soft.object, 40);
      soft.object->move(dirty, soft.object->state().at(dirty));
    }
    shadow.apply_near(*soft.object);
    for (voxel::VoxelId v = 0; v < soft.lattice->size(); v += 7 * voxel::kRow) {
      if (soft.lattice->filled(v)) soft.object->move(v, soft.object->state().at(v));
    }
  }
  EXPECT_LT(soft.object->energy_J(), 1e-6 * first);
}

// The tool is still. The tick runs contact cycles, and the shadow relaxes a state that is some ticks old.
// push_out() runs only once, before the first submission, so that the tool does no work later.
TEST(ShadowObject, TheSumNeverHasMoreEnergyThanTheSubmission) {
  for (const LinkMaterial& material : {elastic(1e4, 0.3), kFirm}) {
    SoftBlock soft({41, 37, 25}, kH, material);
    ShadowObject shadow(*soft.object);
    const ToolInBody tool = soft.ball(6 * kH, 2 * kH);
    soft.touch(tool, 9 * kH);
    soft.object->push_out(tool);
    double before = soft.object->energy_J();
    const double first = before;
    double worst = 0.0;
    for (int n = 0; n < 40; ++n) {
      shadow.submit(*soft.object);
      shadow.relax();
      for (int tick = 0; tick < n % 4; ++tick) soft.object->relax_near(tool, 1);
      shadow.apply_near(*soft.object);
      while (!shadow.all_applied()) {
        shadow.apply_far(*soft.object, 100);
        if (n % 2 == 1) soft.object->relax_near(tool, 1);
      }
      const double now = soft.object->energy_J();
      worst = std::max(worst, (now - before) / first);
      before = now;
    }
    EXPECT_LT(worst, 1e-4);
    EXPECT_LT(before, 0.6 * first);
    EXPECT_EQ(voxel::validate(*soft.lattice, soft.object->state(), kRoundings), "");
  }
}

// A tool moves deep in tissue at its limits, while the shadow's results are old. The limits hold after every
// applied part.
TEST(ShadowObject, NoLinkLeavesItsLimitsInBetween) {
  SoftBlock soft({31, 29, 19}, kH, kFirm);
  ShadowObject shadow(*soft.object);
  std::mt19937_64 random(7);
  const auto uniform = [&random](double low, double high) {
    return low + (high - low) * (static_cast<double>(random() >> 11) * 0x1.0p-53);
  };
  bool given = false;
  for (int tick = 0; tick < 600; ++tick) {
    ToolInBody tool = soft.ball(5 * kH, 0.0);
    tool.centre += glm::dvec3(4 * kH * std::sin(0.031 * tick), 3 * kH * std::sin(0.017 * tick),
                              2 * kH * std::sin(0.05 * tick) - 1.2 * kH);
    soft.touch(tool, 9 * kH);
    soft.object->push_out(tool);
    soft.object->relax_near(tool, 1);
    if (!shadow.all_applied()) {
      shadow.apply_far(*soft.object, 50);
    } else if (given && uniform(0.0, 1.0) < 0.2) {
      shadow.apply_near(*soft.object);
      given = false;
    }
    if (!given && ShadowObject::wanted(*soft.object)) {
      shadow.submit(*soft.object);
      shadow.relax();
      given = true;
    }
    if (tick % 7 == 0) {
      ASSERT_EQ(voxel::validate(*soft.lattice, soft.object->state(), kRoundings), "") << "tick " << tick;
    }
  }
}

}  // namespace
