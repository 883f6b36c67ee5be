// SPDX-License-Identifier: GPL-3.0-or-later
// A soft object with one setting at its extreme is pressed, stroked and released. Every number must be
// finite, no link may exceed its limits, and the object must come to rest. `hybrid stability --extremes` runs
// the same scenes as whole sessions.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <iostream>
#include <string>

#include "tests/voxel/fixtures/lattice_scenes.h"
#include "voxel/chain/chainmail.h"
#include "voxel/object/soft_object.h"

namespace {

using tests::block;
using tests::made_of;
using voxel::Lattice;
using voxel::LinkMaterial;
using voxel::SoftObject;
using voxel::VoxelId;

struct Extreme {
  std::string name;
  std::array<int, 3> dims{11, 11, 8};
  double spacing = 1e-3;
  LinkMaterial material{};
  double depth = 1.0;          // in units of `spacing`
  glm::dvec3 anisotropy{1.0};  // factors of the spacing on each axis
  bool held_at_sides = false;
};

struct Outcome {
  bool finite = true;
  double violation_spacings =
      0.0;  // largest violation of a limit, relative to the larger of one spacing and the displacement
  double most_force_N = 0.0;
  double left_spacings = 0.0;  // displacement left at the end
  bool asleep = false;
};

Outcome press_and_leave(const Extreme& e) {
  const glm::dvec3 spacing = e.spacing * e.anisotropy;
  voxel::LatticeOptions options = made_of(e.material, e.held_at_sides ? nullptr : "-z");
  if (e.held_at_sides) options.anchor_faces = {"-x", "+x", "-y", "+y"};
  SoftObject object(std::make_shared<Lattice>(block(e.dims, spacing), options));
  const Lattice& lattice = object.lattice();
  voxel::ToolInBody tool;
  tool.radius = 3.0 * lattice.max_spacing_m();
  const double reach = object.reach(tool.radius), step = 0.1 * e.spacing;
  const double top = (e.dims[2] - 1) * spacing.z;
  tool.centre = {0.5 * (e.dims[0] - 1) * spacing.x, 0.5 * (e.dims[1] - 1) * spacing.y, top + reach + step};
  Outcome outcome;
  std::vector<VoxelId> near;
  const auto tick = [&](const glm::dvec3& delta) {
    near.clear();
    for (const VoxelId v : lattice.surface()) {
      if (glm::distance(object.position(v), tool.centre) < reach + 4.0 * step) near.push_back(v);
    }
    object.touch(near);
    tool.centre += delta;
    object.follow(delta);
    object.push_out(tool);
    object.relax_near(tool, 1);
    const voxel::Reaction felt = object.reaction(tool);
    object.relax_background(4'000);
    outcome.finite = outcome.finite && std::isfinite(glm::length(felt.force_N));
    outcome.most_force_N = std::max(outcome.most_force_N, glm::length(felt.force_N));
  };
  const auto look = [&] {
    double most = 0.0;
    for (std::size_t i = 0; i < lattice.size(); ++i) {
      const auto v = static_cast<VoxelId>(i);
      if (!lattice.filled(v)) continue;
      const double u = glm::length(object.state().at(v));
      outcome.finite = outcome.finite && std::isfinite(u);
      most = std::max(most, u);
    }
    if (most > 0.0)
      outcome.violation_spacings =
          std::max(outcome.violation_spacings,
                   voxel::worst_violation(lattice, object.state()) / std::max(most, e.spacing));
    return most;
  };
  const int down = static_cast<int>(std::ceil(e.depth / 0.1)) + 1;
  for (int n = 0; n < down; ++n) tick({0.0, 0.0, -step});
  look();
  for (int n = 0; n < 10; ++n) tick({step, 0.4 * step, 0.0});
  for (int n = 0; n < 50; ++n) tick(glm::dvec3(0.0));
  look();
  for (int n = 0; n < down + 20; ++n) tick({0.0, 0.0, step});
  object.touch({});
  for (int n = 0; n < 4'000 && !object.asleep(); ++n) object.relax_background(20'000);
  outcome.asleep = object.asleep();
  outcome.left_spacings = look() / e.spacing;
  return outcome;
}

void expect_rest(const Extreme& e) {
  SCOPED_TRACE(e.name);
  const Outcome o = press_and_leave(e);
  std::cout << "[ measured ] " << e.name << ": at most " << o.most_force_N << " N, links beyond by "
            << o.violation_spacings << ", " << o.left_spacings << " spacings left\n";
  EXPECT_TRUE(o.finite);
  EXPECT_TRUE(o.asleep);
  EXPECT_LE(o.violation_spacings, 1e-5);
  EXPECT_LE(o.left_spacings, 0.02 * e.depth);
}

LinkMaterial of(double low, double high, double shear, double young = 1e4) {
  return {.young_Pa = young, .stretch_min = low, .stretch_max = high, .shear = shear};
}

TEST(SoftExtremes, StretchLimits) {
  for (const double low : {1e-3, 0.1, 0.5, 0.9, 0.99})
    expect_rest({.name = "stretch from " + std::to_string(low), .material = of(low, 2.0 - low, 1.0 - low)});
}

TEST(SoftExtremes, NoSlackAtAllMovesNothing) {
  const Outcome o = press_and_leave({.name = "no slack", .material = of(1.0, 1.0, 0.0)});
  EXPECT_TRUE(o.finite && o.asleep);
  EXPECT_EQ(o.left_spacings, 0.0);
}

// Links with little or no slack along them and much slack across them, or the reverse. Voxels then move as
// rows or as layers.
TEST(SoftExtremes, SlackOneWayOnly) {
  expect_rest({.name = "none along", .material = of(1.0, 1.0, 0.6)});
  for (const double slack : {1e-4, 1e-2}) {
    expect_rest({.name = std::to_string(slack) + " across", .material = of(0.4, 1.6, slack)});
  }
  expect_rest({.name = "0.01 along", .material = of(0.99, 1.01, 0.6)});
}

// Links with nearly no slack along them or across them. A cluster (cluster_steps.h) would need very many
// steps from limit to limit to return. So it stays where the tool left it, but all other conditions hold.
TEST(SoftExtremes, HardlyAnySlackOneWayOnlyIsKeptWithinItsLimits) {
  for (const LinkMaterial& material : {of(0.4, 1.6, 0.0), of(0.4, 1.6, 1e-6), of(1.0 - 1e-6, 1.0 + 1e-6, 0.6),
                                       of(1.0 - 1e-4, 1.0 + 1e-4, 0.6)}) {
    const Outcome o = press_and_leave({.name = "", .material = material});
    EXPECT_TRUE(o.finite && o.asleep);
    EXPECT_LE(o.violation_spacings, 1e-5);
  }
}

TEST(SoftExtremes, NearlyNoSlack) {
  for (const double slack : {1e-6, 1e-4, 1e-2}) {
    expect_rest(
        {.name = std::to_string(slack) + " of slack", .material = of(1.0 - slack, 1.0 + slack, slack)});
  }
}

TEST(SoftExtremes, Stiffness) {
  for (const double young : {1.0, 1e3, 1e6, 1e9, 1e12})
    expect_rest({.name = std::to_string(young) + " Pa", .material = of(0.4, 1.6, 0.6, young)});
}

TEST(SoftExtremes, Spacing) {
  for (const double spacing : {1e-6, 1e-4, 0.1, 10.0})
    expect_rest({.name = std::to_string(spacing) + " m", .spacing = spacing, .material = of(0.4, 1.6, 0.6)});
  expect_rest(
      {.name = "slices ten times as far apart", .material = of(0.4, 1.6, 0.6), .anisotropy = {1, 1, 10}});
}

// The force is proportional to Young's modulus and to the square of the spacing. All else is equal.
TEST(SoftExtremes, ForcesScale) {
  const double plain = press_and_leave({.name = "", .material = of(0.4, 1.6, 0.6, 1e4)}).most_force_N;
  for (const double young : {1.0, 1e12}) {
    const double force = press_and_leave({.name = "", .material = of(0.4, 1.6, 0.6, young)}).most_force_N;
    EXPECT_NEAR(force / young, plain / 1e4, 1e-3 * plain / 1e4) << young << " Pa";
  }
  for (const double spacing : {1e-6, 10.0}) {
    const double force =
        press_and_leave({.name = "", .spacing = spacing, .material = of(0.4, 1.6, 0.6, 1e4)}).most_force_N;
    EXPECT_NEAR(force / (spacing * spacing), plain / 1e-6, 1e-3 * plain / 1e-6) << spacing << " m";
  }
}

TEST(SoftExtremes, OneVoxelThick) {
  expect_rest({.name = "a sheet", .dims = {15, 15, 1}, .material = of(0.4, 1.6, 0.6), .held_at_sides = true});
  expect_rest({.name = "a sheet on edge", .dims = {15, 1, 9}, .material = of(0.4, 1.6, 0.6)});
  expect_rest({.name = "a row", .dims = {1, 1, 9}, .material = of(0.4, 1.6, 0.6)});
  // the single voxel is its own bottom layer, so it is anchored and rigid
  const Outcome one =
      press_and_leave({.name = "one voxel", .dims = {1, 1, 1}, .material = of(0.4, 1.6, 0.6)});
  EXPECT_TRUE(one.finite && one.asleep);
  EXPECT_EQ(one.left_spacings, 0.0);
}

}  // namespace
