// SPDX-License-Identifier: GPL-3.0-or-later
// Closed forms against values computed by hand.
#include "hybrid/compare/closed_form.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

namespace {

using glm::dvec3;
using hybrid::ClosedForm;
using hybrid::Tool;

const Tool ball{.shape = Tool::Shape::ball, .radius_m = 5e-3, .stiffness_N_per_m = 1000.0};
const Tool punch{.shape = Tool::Shape::punch, .radius_m = 5e-3, .stiffness_N_per_m = 1000.0};
const ClosedForm rigid_ball{
    .shape = ClosedForm::Shape::ball, .pose = {}, .half_size_m = dvec3(0.02), .caveat = {}};
const ClosedForm rigid_box{
    .shape = ClosedForm::Shape::box, .pose = {}, .half_size_m = {0.03, 0.02, 0.01}, .caveat = {}};

TEST(ClosedForm, DepthInABall) {
  const auto depth = depth_in(rigid_ball, ball, {0.0, 0.0, 0.022});  // contact begins at 25 mm
  EXPECT_NEAR(depth.depth_m, 3e-3, 1e-15);
  EXPECT_EQ(depth.out, dvec3(0, 0, 1));
  const auto oblique =
      depth_in(rigid_ball, ball, dvec3(0.012, 0.0, -0.016));  // 20 mm from the centre; a 3-4-5 triangle
  EXPECT_NEAR(oblique.depth_m, 5e-3, 1e-15);
  EXPECT_NEAR(glm::length(oblique.out - dvec3(0.6, 0.0, -0.8)), 0.0, 1e-12);
  EXPECT_LT(depth_in(rigid_ball, ball, {0.03, 0, 0}).depth_m, 0.0);
}

TEST(ClosedForm, DepthInABoxAtFaceEdgeAndCorner) {
  EXPECT_NEAR(depth_in(rigid_box, ball, {0.0, 0.0, 0.012}).depth_m, 3e-3, 1e-15);
  EXPECT_NEAR(depth_in(rigid_box, ball, {0.0, 0.0, 0.008}).depth_m, 7e-3,
              1e-15);                                                // the tool's centre is inside
  const auto edge = depth_in(rigid_box, ball, {0.033, 0.0, 0.014});  // 3 and 4 mm out: 5 mm from the edge
  EXPECT_NEAR(edge.depth_m, 0.0, 1e-15);
  EXPECT_NEAR(glm::length(edge.out - dvec3(0.6, 0.0, 0.8)), 0.0, 1e-12);
  const auto corner =
      depth_in(rigid_box, ball, {0.031, 0.022, 0.012});  // 1, 2 and 2 mm out: 3 mm from the corner
  EXPECT_NEAR(corner.depth_m, 2e-3, 1e-15);
  EXPECT_NEAR(glm::length(corner.out - dvec3(1.0, 2.0, 2.0) / 3.0), 0.0, 1e-12);
}

TEST(ClosedForm, AFlatPunchIsMeasuredAtItsFace) {
  EXPECT_NEAR(depth_in(rigid_box, punch, {0.0, 0.0, 0.008}).depth_m, 2e-3, 1e-15);
}

TEST(ClosedForm, FollowsThePose) {
  ClosedForm turned = rigid_box;
  turned.pose = {
      {1.0, 2.0, 3.0},
      glm::angleAxis(glm::radians(90.0), dvec3(0, 1, 0))};  // the box's z points along the scene's x
  const auto depth = depth_in(turned, ball, {1.012, 2.0, 3.0});
  EXPECT_NEAR(depth.depth_m, 3e-3, 1e-12);
  EXPECT_NEAR(glm::length(depth.out - dvec3(1, 0, 0)), 0.0, 1e-12);
}

TEST(ClosedForm, RigidIsTheCouplingAlone) {
  EXPECT_DOUBLE_EQ(force_at(rigid_ball, ball, 2e-3), 2.0);
  EXPECT_EQ(force_at(rigid_ball, ball, 0.0), 0.0);
  EXPECT_EQ(force_at(rigid_ball, ball, -1e-3), 0.0);
  EXPECT_STREQ(law_of(rigid_ball, ball), "rigid closed form");
}

TEST(ClosedForm, AFlatPunchOnTissueIsTwoSpringsInSeries) {
  ClosedForm block = rigid_box;
  block.young_Pa = 91'000.0;
  block.poisson =
      0.3;  // E* = 91000 / 0.91 = 100,000 Pa; the stiffness 2 a E* = 1000 N/m equals the coupling's
  EXPECT_NEAR(force_at(block, punch, 4e-3), 2.0, 1e-9);
  EXPECT_STREQ(law_of(block, punch), "flat punch");
}

TEST(ClosedForm, HertzInSeriesWithTheCoupling) {
  ClosedForm block = rigid_box;
  block.young_Pa = 7'500.0;
  block.poisson = 0.0;  // E* = 7500 Pa, so 4/3 E* = 10,000 Pa
  // At an indentation of 4 mm: 10,000 · √0.005 · 0.004^1.5 = 0.178885 N, and the coupling is extended by F /
  // K.
  const double force = 10'000.0 * std::sqrt(5e-3) * std::pow(4e-3, 1.5);
  EXPECT_NEAR(force, 0.178885, 1e-6);
  EXPECT_NEAR(force_at(block, ball, 4e-3 + force / 1000.0), force, 1e-9);
  EXPECT_STREQ(law_of(block, ball), "hertz");

  ClosedForm soft_ball = rigid_ball;  // balls of 20 mm and 5 mm: effective radius R = 4 mm
  soft_ball.young_Pa = 7'500.0;
  soft_ball.poisson = 0.0;
  const double on_ball = 10'000.0 * std::sqrt(4e-3) * std::pow(4e-3, 1.5);
  EXPECT_NEAR(force_at(soft_ball, ball, 4e-3 + on_ball / 1000.0), on_ball, 1e-9);
}

TEST(ClosedForm, ForceGrowsWithDepthAndNeverPassesTheCoupling) {
  ClosedForm block = rigid_box;
  double before = 0.0;
  for (const double young : {1.0, 1e3, 1e6, 1e12}) {
    block.young_Pa = young;
    before = 0.0;
    for (int step = 0; step < 42; ++step) {
      const double d = 1e-6 * std::pow(1.3, step);  // up to 0.05 m
      for (const Tool& tool : {ball, punch}) {
        const double force = force_at(block, tool, d);
        EXPECT_GT(force, 0.0);
        EXPECT_LE(force, 1000.0 * d * (1.0 + 1e-12));
      }
      EXPECT_GT(force_at(block, ball, d), before);
      before = force_at(block, ball, d);
    }
  }
}

TEST(ClosedForm, SaysWhichDescriptionsHaveOne) {
  hybrid::RigidDescription rigid{.name = "b",
                                 .source = hybrid::BoxPrimitive{{0.02, 0.04, 0.06}},
                                 .pose = {},
                                 .place = {},
                                 .source_place = {}};
  const auto box = closed_form_of(rigid);
  ASSERT_TRUE(box.has_value());
  EXPECT_EQ(box->half_size_m, dvec3(0.01, 0.02, 0.03));
  rigid.source = hybrid::MeshSource{.file = "a.ply"};
  EXPECT_FALSE(closed_form_of(rigid).has_value());

  hybrid::Scene scene;
  scene.materials["gel"] = {.young_Pa = 9e3, .poisson = 0.2, .place = {}};
  hybrid::SoftDescription soft;
  voxel::Formula formula;
  formula.size_m = dvec3(0.1, 0.08, 0.06);
  soft.source = formula;
  soft.material = "gel";
  const auto block = closed_form_of(scene, soft);
  ASSERT_TRUE(block.has_value());
  EXPECT_EQ(block->young_Pa, 9e3);
  EXPECT_EQ(block->half_size_m, dvec3(0.05, 0.04, 0.03));
  EXPECT_NE(block->caveat.find("half-space"), std::string::npos);
  formula.layers.push_back({0.01, 2});
  soft.source = formula;
  EXPECT_NE(closed_form_of(scene, soft)->caveat.find("left out"), std::string::npos);
}

}  // namespace
