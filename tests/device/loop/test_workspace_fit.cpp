// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/loop/workspace_fit.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

namespace {

using device::Box;
using device::WorkspaceFit;

const Box kTouch{{-0.08, -0.06, -0.035}, {0.08, 0.06, 0.035}};

TEST(WorkspaceFit, TheFramesDifferByAQuarterTurn) {
  // Right stays right and up stays up. The direction towards the user becomes the scene's −y.
  EXPECT_EQ(device::device_to_scene_axes({1, 0, 0}), glm::dvec3(1, 0, 0));
  EXPECT_EQ(device::device_to_scene_axes({0, 1, 0}), glm::dvec3(0, 0, 1));
  EXPECT_EQ(device::device_to_scene_axes({0, 0, 1}), glm::dvec3(0, -1, 0));
  const glm::dvec3 a(0.3, -1.2, 2.5), b(-0.7, 0.4, 1.1);
  EXPECT_EQ(device::scene_to_device_axes(device::device_to_scene_axes(a)), a);
  // The map is a rotation, so it keeps lengths, angles and handedness.
  EXPECT_DOUBLE_EQ(glm::dot(device::device_to_scene_axes(a), device::device_to_scene_axes(b)),
                   glm::dot(a, b));
  EXPECT_EQ(glm::cross(device::device_to_scene_axes({1, 0, 0}), device::device_to_scene_axes({0, 1, 0})),
            device::device_to_scene_axes({0, 0, 1}));
}

TEST(WorkspaceFit, CentreGoesToCentre) {
  const Box wanted{{0.1, 0.2, 0.3}, {0.15, 0.22, 0.34}};
  const WorkspaceFit fit = fit_workspace(kTouch, wanted, 1.0);
  EXPECT_EQ(fit.scale, 1.0);
  EXPECT_EQ(fit.position({0, 0, 0}), 0.5 * (wanted.low_m + wanted.high_m));
  EXPECT_TRUE(covers(fit, kTouch, wanted));
}

TEST(WorkspaceFit, ASceneThatIsTooLargeIsToldAndCanBeFitted) {
  const Box wanted{{-0.1, -0.07, 0.0},
                   {0.1, 0.07, 0.06}};  // 200 x 140 x 60 mm; the device has 160 x 70 x 120 mm
  EXPECT_FALSE(covers(fit_workspace(kTouch, wanted, 1.0), kTouch, wanted));
  const WorkspaceFit fitted = fit_workspace(kTouch, wanted, {});
  EXPECT_DOUBLE_EQ(fitted.scale, 2.0);  // 140 mm / 70 mm
  EXPECT_TRUE(covers(fitted, kTouch, wanted));
  // A small scene is not enlarged unless the user asks for it.
  EXPECT_EQ(fit_workspace(kTouch, {{0, 0, 0}, {0.01, 0.01, 0.01}}, {}).scale, 1.0);
}

// A fit never enlarges the force. If it enlarges motion, the hand's power is the scene's divided by the scale
// squared.
TEST(WorkspaceFit, ForcesAreNeverMadeLarger) {
  const glm::dvec3 force(1, -2, 3), velocity(0.1, 0.3, -0.2);
  for (const double scale : {0.1, 0.5, 1.0, 2.0, 10.0}) {
    WorkspaceFit fit;
    fit.scale = scale;
    EXPECT_LE(glm::length(fit.force(force)), glm::length(force) * (1 + 1e-15)) << scale;
    const double hand_W = glm::dot(fit.force(force), velocity);
    const double scene_W = glm::dot(force, fit.velocity(velocity));
    if (scale >= 1.0) {
      EXPECT_NEAR(hand_W, scene_W / (scale * scale), 1e-12) << scale;
    }
    EXPECT_GE(hand_W * scene_W, 0.0) << scale;
  }
  // The hand feels at most the scene's 1000 N/m.
  for (const double scale : {0.5, 1.0, 4.0}) {
    WorkspaceFit fit;
    fit.scale = scale;
    const double moved_m = fit.position({1e-3, 0, 0}).x - fit.position({0, 0, 0}).x;
    const double felt_N = fit.force({1000.0 * moved_m, 0, 0}).x;
    EXPECT_LE(felt_N / 1e-3, 1000.0 * (1 + 1e-12)) << scale;
  }
}

}  // namespace
