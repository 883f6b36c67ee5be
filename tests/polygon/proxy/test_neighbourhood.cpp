// SPDX-License-Identifier: GPL-3.0-or-later
// The neighbourhood against brute force over all triangles: no triangle that could be touched is missing, and
// every plane has its triangle on one side.
#include <gtest/gtest.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <random>
#include <set>

#include "polygon/mesh/triangle.h"
#include "polygon/proxy/neighbourhood.h"
#include "polygon/surface/mesh_surface.h"
#include "polygon/surface/primitives.h"

namespace {

using glm::dvec3;
using polygon::Neighbourhood;

class NeighbourhoodTest : public ::testing::TestWithParam<double> {
 protected:
  double radius() const { return GetParam(); }
  dvec3 direction() {
    std::normal_distribution<double> normal;
    const double x = normal(random_), y = normal(random_), z = normal(random_);
    return glm::normalize(dvec3(x, y, z));
  }
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  double distance(std::uint32_t t, const dvec3& p) const {
    const auto& v = mesh_.vertices;
    const auto& c = mesh_.triangles[t];
    return glm::length(p - polygon::closest_point_on_triangle(p, v[c[0]], v[c[1]], v[c[2]]));
  }

  std::mt19937_64 random_{2024};
  polygon::TriangleMesh mesh_ = polygon::make_ball_mesh(0.05, 4);
  std::unique_ptr<polygon::RigidSurface> surface_ = polygon::make_mesh_surface(mesh_, true);
};

TEST_P(NeighbourhoodTest, MissesNothingThatABallCouldTouchInIt) {
  Neighbourhood near;
  for (int n = 0; n < 200; ++n) {
    const dvec3 view = direction() * (0.05 + radius() + uniform(0.0, 0.002));
    const dvec3 centre = view + direction() * 1e-3;
    const double margin = uniform(1e-3, 6e-3);
    ASSERT_TRUE(near.survey(*surface_, centre, margin, radius(), view));
    std::set<std::uint32_t> known;
    for (std::uint32_t i = 0; i < near.size(); ++i) known.insert(near.element(i));
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
      if (distance(t, centre) <= radius() + margin) {
        ASSERT_TRUE(known.count(t)) << t;
      }
    }
  }
}

// A point that violates no plane is clear of every element. So is the straight path to this point.
TEST_P(NeighbourhoodTest, WhatBreaksNoPlaneIsClear) {
  Neighbourhood near;
  int clear = 0;
  for (int n = 0; n < 100; ++n) {
    const dvec3 view = direction() * (0.05 + radius() + uniform(1e-6, 0.002));
    const double margin = 4e-3;
    ASSERT_TRUE(near.survey(*surface_, view, margin, radius(), view));
    for (int k = 0; k < 50; ++k) {
      const dvec3 to = view + direction() * uniform(0.0, margin);
      if (!near.violated(view, to, 1e-15).empty()) continue;
      ++clear;
      for (const double part : {0.25, 0.5, 0.75, 1.0}) {
        const dvec3 p = view + part * (to - view);
        for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t)
          ASSERT_GE(distance(t, p), radius() * (1.0 - 1e-12) - 1e-15);
      }
    }
  }
  EXPECT_GT(clear, 500);
}

TEST_P(NeighbourhoodTest, SeparatingPlanesHaveTheirElementBehindThem) {
  for (int n = 0; n < 2000; ++n) {
    const dvec3 view = direction() * (0.05 + radius() + uniform(1e-6, 0.01));
    const auto t = static_cast<std::uint32_t>(uniform(0.0, static_cast<double>(mesh_.triangles.size())));
    polygon::SeparatingPlane own;
    const polygon::SeparatingPlane plane = polygon::separating_plane(*surface_, t, view, radius());
    EXPECT_NEAR(glm::length(plane.normal), 1.0, 1e-12);
    const bool flat = polygon::separating_face_plane(*surface_, t, view, radius(), 1e-15, own);
    for (const std::uint32_t corner : mesh_.triangles[t]) {
      EXPECT_LE(glm::dot(plane.normal, mesh_.vertices[corner]) + radius(), plane.offset + 1e-15);
      if (flat) {
        EXPECT_LE(glm::dot(own.normal, mesh_.vertices[corner]) + radius(), own.offset + 1e-15);
      }
    }
    // The plane is perpendicular to the shortest line from the view to the element. Its distance from the
    // view is the greatest possible. A ball on the plane would just touch the element.
    EXPECT_NEAR(plane.offset - radius(), glm::dot(plane.normal, view) - distance(t, view), 1e-12);
    if (flat) {
      EXPECT_GE(glm::dot(own.normal, view), own.offset - 1e-15);
    }
  }
}

TEST_P(NeighbourhoodTest, SeenFromElsewhereItsPlanesHoldThere) {
  Neighbourhood near;
  for (int n = 0; n < 100; ++n) {
    const dvec3 view = direction() * (0.05 + radius() + 1e-3);
    ASSERT_TRUE(near.survey(*surface_, view, 8e-3, radius(), view));
    const dvec3 other = glm::normalize(view + direction() * 4e-3) * (0.05 + radius() + 1e-4);
    near.refresh_planes(*surface_, other, radius(), 1e-15);
    EXPECT_TRUE(near.violated(other, other, 1e-14).empty());
  }
}

TEST(Neighbourhood, KnowsNothingUntilAskedAndHowMuchRoomThereIs) {
  Neighbourhood near;
  EXPECT_FALSE(near.known());
  EXPECT_LT(near.margin_left(dvec3(0.0)), 0.0);
  const auto ball = polygon::make_ball_surface(0.02);
  ASSERT_TRUE(near.survey(*ball, dvec3(0, 0, 0.03), 0.005, 1e-3, dvec3(0, 0, 0.03)));
  EXPECT_EQ(near.size(), 0U);  // the ball's surface is further away than margin and radius together, 6 mm
  EXPECT_DOUBLE_EQ(near.margin_left(dvec3(0, 0, 0.032)), 0.003);
  ASSERT_TRUE(near.survey(*ball, dvec3(0, 0, 0.025), 0.005, 1e-3, dvec3(0, 0, 0.025)));
  EXPECT_EQ(near.size(), 1U);
  near.forget();
  EXPECT_FALSE(near.known());
}

TEST(Neighbourhood, SaysWhenThereIsTooMuchToKnow) {
  const auto mesh = polygon::make_ball_mesh(0.05, 6);
  const auto surface = polygon::make_mesh_surface(mesh, true);
  Neighbourhood near;
  EXPECT_FALSE(near.survey(*surface, dvec3(0, 0, 0.051), 0.04, 1e-3, dvec3(0, 0, 0.051)));
  EXPECT_FALSE(near.known());
  EXPECT_TRUE(near.survey(*surface, dvec3(0, 0, 0.051), 1e-3, 1e-3, dvec3(0, 0, 0.051)));
}

INSTANTIATE_TEST_SUITE_P(PointAndBall, NeighbourhoodTest, ::testing::Values(1e-8, 2e-3));

}  // namespace
