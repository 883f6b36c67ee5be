// SPDX-License-Identifier: GPL-3.0-or-later
// Friction in the whole tick. It has the given coefficients and is never a source of energy.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <vector>

#include "tests/hybrid/fixtures/feel_scene.h"

namespace {

using namespace tests;  // NOLINT(google-build-using-namespace): these tests use the whole fixture

// ---- friction: the cones

struct Ramp {
  double breakaway = 0.0;              // tangent of the angle at which sliding began
  std::vector<double> sliding;         // [tick of the slide] tangent of the force's angle
  double crept_m = 0.0;                // travel of the proxy before sliding
  std::vector<double> normal_degrees;  // angles between the reference normal and the ideal normal
};

// Moves the device along device(tick) until the proxy has slid for `slide` ticks. Angles are between the
// force and the normal of the touched surface.
Ramp drag(Touch& touch, const dvec3& above, const std::function<dvec3(int)>& device, int ticks, int slide) {
  Ramp ramp;
  touch.go(above, 1e-3);
  TickResult felt = touch.go(device(0), 1e-3, 3);
  EXPECT_TRUE(touch.state().stuck);
  const dvec3 held = felt.proxy_m;
  double before = 0.0;
  for (int n = 1, slid = 0; n < ticks && slid < slide; ++n) {
    felt = touch.at(device(n));
    const double tangent =
        std::tan(glm::radians(degrees_between(felt.force_N, contact_normal(touch.state()))));
    if (touch.state().stuck && slid == 0) {
      before = tangent;
      ramp.crept_m = std::max(ramp.crept_m, glm::length(felt.proxy_m - held));
      continue;
    }
    if (slid++ == 0) ramp.breakaway = before;
    ramp.sliding.push_back(tangent);
  }
  return ramp;
}

void expect_coulomb(const char* name, const Ramp& ramp, double step_share) {
  ASSERT_FALSE(ramp.sliding.empty()) << "it never slid";
  const auto [low, high] = std::minmax_element(ramp.sliding.begin(), ramp.sliding.end());
  std::printf("friction, %s: breaks away at tan %.5f of %.2f; slides at %.6f to %.6f of %.2f\n", name,
              ramp.breakaway, kStatic, *low, *high, kDynamic);
  EXPECT_LE(ramp.breakaway, kStatic * (1.0 + 1e-9)) << "held beyond the cone";
  EXPECT_GE(ramp.breakaway, kStatic * (1.0 - step_share)) << "let go before the cone";
  EXPECT_NEAR(*low, kDynamic, 0.01 * kDynamic);
  EXPECT_NEAR(*high, kDynamic, 0.01 * kDynamic);
  EXPECT_EQ(ramp.crept_m, 0.0) << "stuck is stuck";
}

constexpr double kFine = 5e-6;  // device step per tick (m): 0.3 % of the travel that the cone allows

TEST_F(Feel, APlaneHoldsToTheStaticConeAndLetsSlideAtTheDynamicOne) {
  Touch touch(scene_of({rough(plane())}, kRadius), {0, 0, 0.02});
  const auto device = [](int n) { return dvec3(kFine * n, 0.5 * kFine * n, kRadius - 3e-3); };
  expect_coulomb("plane", drag(touch, {0, 0, 0.01}, device, 4000, 2000), 0.01);
}

TEST_F(Feel, ABoxOfTrianglesDoesToo) {
  Touch touch(scene_of({rough(box())}, kRadius), {0, 0, 0.02});
  const auto device = [](int n) { return dvec3(-0.01 + kFine * n, 0.003 - 0.7 * kFine * n, kRadius - 3e-3); };
  expect_coulomb("box mesh", drag(touch, {-0.01, 0.003, 0.01}, device, 5000, 3000), 0.01);
}

// The device moves along a great circle at a constant depth, over faces, edges and corners of the ball.
TEST_F(Feel, AnIcosphereDoesToo) {
  Touch touch(scene_of({rough(ball())}, kRadius), {0, 0, 0.08});
  const dvec3 x = glm::normalize(dvec3(1, 0.3, 0.2)), z = glm::normalize(glm::cross(x, dvec3(0.1, 1, 0.4)));
  const auto device = [&](int n) {
    const double angle = kFine * n / kBall;
    return (kBall - 3e-3) * (std::cos(angle) * x + std::sin(angle) * z);
  };
  expect_coulomb("icosphere of 1,280", drag(touch, 0.06 * x, device, 30000, 25000), 0.01);
}

// At the speed of a hand, the proxy moves around half an edge per tick.
TEST_F(Feel, AnIcosphereDoesTooAtTenCentimetersASecond) {
  Touch touch(scene_of({rough(ball())}, kRadius), {0, 0, 0.08});
  const dvec3 x = glm::normalize(dvec3(1, 0.3, 0.2)), z = glm::normalize(glm::cross(x, dvec3(0.1, 1, 0.4)));
  std::vector<double> tangent;
  touch.go(0.06 * x, 1e-3);
  for (int n = 0; n < 4000; ++n) {
    const double angle = 1e-4 * n / kBall;
    const TickResult felt = touch.at((kBall - 3e-3) * (std::cos(angle) * x + std::sin(angle) * z));
    if (touch.state().sliding && n > 100)
      tangent.push_back(std::tan(glm::radians(degrees_between(felt.force_N, contact_normal(touch.state())))));
  }
  ASSERT_GT(tangent.size(), 3000U);
  std::sort(tangent.begin(), tangent.end());
  std::printf("friction, icosphere at 0.1 m/s: tan %.5f (p1) %.5f (p50) %.5f (p99), %.5f to %.5f\n",
              tangent[tangent.size() / 100], tangent[tangent.size() / 2],
              tangent[tangent.size() - 1 - tangent.size() / 100], tangent.front(), tangent.back());
  EXPECT_NEAR(tangent[tangent.size() / 100], kDynamic, 0.01 * kDynamic);
  EXPECT_NEAR(tangent[tangent.size() - 1 - tangent.size() / 100], kDynamic, 0.01 * kDynamic);
}

// ---- friction: energy

TEST_F(Feel, StickAndSlipOnAPlaneGivesTheHandNothing) {
  for (const Way& way : ways_on_the_flat()) {
    Touch touch(scene_of({rough(plane())}, kRadius), {0, 0, 0.02});
    expect_no_gain(std::string("plane, ") + way.name, closed_way(touch, {0, 0, 0.01}, way.at, 3, 1e-5));
  }
}

TEST_F(Feel, StickAndSlipOverTheEdgesOfABoxGivesTheHandNothing) {
  // The box's edge is at x = 30 mm, and the box is 40 mm thick.
  const std::vector<Way> ways{
      {"over the edge and back",
       [](double p) { return dvec3(0.03 + 5e-3 * wave(p), 2e-3 * cowave(p), kRadius - 3e-3); }},
      {"round the edge",
       [](double p) { return dvec3(0.03 - 6e-3 * cowave(p), 3e-3 * wave(p), 6e-3 * wave(p)); }},
      {"round the edge, the other way",
       [](double p) { return dvec3(0.03 - 6e-3 * cowave(p), 0, -6e-3 * wave(p)); }},
      {"round the corner", [](double p) {
         return dvec3(0.03 - 5e-3 * cowave(p), 0.03 - 5e-3 * wave(p), -1e-3 - 4e-3 * wave(p, 2.0));
       }}};
  for (const Way& way : ways) {
    Touch touch(scene_of({rough(box())}, kRadius), {0.01, 0, 0.02});
    expect_no_gain(std::string("box, ") + way.name, closed_way(touch, {0.03, 0.03, 0.02}, way.at, 3, 1e-5));
  }
}

TEST_F(Feel, StickAndSlipOnAnIcosphereGivesTheHandNothing) {
  const auto around = [](double turn, double tilt, double depth) {
    const dvec3 out(std::cos(turn) * std::cos(tilt), std::sin(turn) * std::cos(tilt), std::sin(tilt));
    return (kBall + kRadius - depth) * out;
  };
  const std::vector<Way> ways{
      {"to and fro", [=](double p) { return around(0.3 * wave(p), 0.1 * wave(p), 4e-3); }},
      {"a circle", [=](double p) { return around(0.3 * cowave(p), 0.3 * wave(p), 4e-3); }},
      {"an eight, deeper at its ends",
       [=](double p) { return around(0.4 * cowave(p), 0.2 * wave(p, 2.0), 3e-3 + 2e-3 * wave(p, 2.0)); }}};
  for (const Way& way : ways) {
    Touch touch(scene_of({rough(ball())}, kRadius), {0.08, 0, 0});
    expect_no_gain(std::string("icosphere, ") + way.name, closed_way(touch, {0.06, 0, 0}, way.at, 3, 1e-5));
  }
}

TEST_F(Feel, AWedgeHoldsByBothItsFaces) {
  // Two planes at 90 degrees form a groove. The tool is pressed into the groove and dragged along it.
  RigidDescription left = rough(plane()), right = rough(plane());
  left.name = "left";
  right.name = "right";
  left.pose.rotation = glm::angleAxis(glm::pi<double>() / 4.0, dvec3(0, 1, 0));
  right.pose.rotation = glm::angleAxis(-glm::pi<double>() / 4.0, dvec3(0, 1, 0));
  Touch touch(scene_of({left, right}, kRadius), {0, 0, 0.03});
  const auto device = [](int n) { return dvec3(0, kFine * n, 0); };  // the proxy is at z = √2 r
  expect_coulomb("groove", drag(touch, {0, 0, 0.01}, device, 4000, 2000), 0.01);
  Touch again(scene_of({left, right}, kRadius), {0, 0, 0.03});
  expect_no_gain(
      "groove",
      closed_way(
          again, {0, 0, 0.01},
          [](double p) { return dvec3(2e-3 * wave(p), 4e-3 * cowave(p), -1e-3 * wave(p, 2.0)); }, 3, 1e-5));
}

}  // namespace
