// SPDX-License-Identifier: GPL-3.0-or-later
// What lies across a triangle's edges, and the way over one that is nearly flat.
#include "polygon/proxy/edge_crossing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <map>
#include <random>
#include <set>

#include "polygon/surface/mesh_surface.h"
#include "polygon/surface/primitives.h"
#include "polygon/mesh/topology.h"

namespace {

using glm::dvec3;
using polygon::TriangleIndices;
using polygon::TriangleMesh;

constexpr double kRadius = 1e-3, kRounding = 1e-16;

// Two triangles with an edge along y at the origin; the second falls by `degrees` towards +x.
TriangleMesh roof(double degrees) {
  const double bend = glm::radians(degrees);
  TriangleMesh mesh;
  mesh.vertices = {{0, -1, 0}, {0, 1, 0}, {-1, 0, 0}, {std::cos(bend), 0, -std::sin(bend)}};
  mesh.triangles = {{0, 1, 2}, {1, 0, 3}};
  return mesh;
}

polygon::Ridges ridges_of_first(const TriangleMesh& mesh, const dvec3& up = {0, 0, 1}) {
  const auto surface = polygon::make_mesh_surface(mesh, false);
  return polygon::ridges_of(*surface, 0, {up, kRadius}, kRadius, kRounding);
}

TEST(TrianglesAcross, AreThoseThatShareBothCorners) {
  std::mt19937_64 random(3);
  for (int round = 0; round < 20; ++round) {
    // Any soup over a few points: edges with one, two and more triangles, repeated corners among them.
    std::vector<TriangleIndices> triangles(40);
    for (TriangleIndices& t : triangles) {
      for (std::uint32_t& i : t) i = static_cast<std::uint32_t>(random() % 12);
    }
    std::map<std::set<std::uint32_t>, std::vector<std::uint32_t>> by_edge;
    for (std::uint32_t n = 0; n < triangles.size(); ++n) {
      const TriangleIndices& t = triangles[n];
      if (polygon::has_repeated_corner(t)) continue;
      for (std::size_t i = 0; i < 3; ++i) by_edge[{t[i], t[(i + 1) % 3]}].push_back(n);
    }
    const std::vector<TriangleIndices> across = polygon::triangles_across(triangles, 12);
    ASSERT_EQ(across.size(), triangles.size());
    for (std::uint32_t n = 0; n < triangles.size(); ++n) {
      const TriangleIndices& t = triangles[n];
      for (std::size_t i = 0; i < 3; ++i) {
        std::uint32_t expected = polygon::kNoTriangle;
        if (!polygon::has_repeated_corner(t)) {
          const std::vector<std::uint32_t>& uses = by_edge[{t[i], t[(i + 1) % 3]}];
          if (uses.size() == 2) expected = uses[0] == n ? uses[1] : uses[0];
        }
        EXPECT_EQ(across[n][i], expected);
      }
    }
  }
}

TEST(TrianglesAcross, VerticesInTheSamePlaceAreOneCorner) {
  TriangleMesh mesh = roof(10);
  mesh.vertices.push_back(mesh.vertices[0]);
  mesh.vertices.push_back(mesh.vertices[1]);
  mesh.triangles[1] = {5, 4, 3};
  const auto surface = polygon::make_mesh_surface(mesh, false);
  EXPECT_EQ(surface->neighbours(0)[0], 1U);
  EXPECT_EQ(surface->neighbours(1)[0], 0U);
  EXPECT_EQ(surface->neighbours(0)[1], polygon::kNoElement);
}

TEST(Ridges, AreConvexAndNearlyFlat) {
  for (const double degrees : {0.01, 1.0, 29.0})
    EXPECT_EQ(ridges_of_first(roof(degrees)).count, 1U) << degrees;
  for (const double degrees : {0.0, 31.0, 60.0, 90.0, 150.0, -0.01, -1.0, -29.0, -90.0})
    EXPECT_EQ(ridges_of_first(roof(degrees)).count, 0U) << degrees;
}

TEST(Ridges, FromBelowAValleyIsARidge) {
  EXPECT_EQ(ridges_of_first(roof(-10), {0, 0, -1}).count, 1U);
  EXPECT_EQ(ridges_of_first(roof(10), {0, 0, -1}).count, 0U);
}

TEST(Ridges, TrianglesNeedNotBeOrientedAlike) {
  TriangleMesh mesh = roof(10);
  std::swap(mesh.triangles[1][0], mesh.triangles[1][1]);
  const polygon::Ridges ridges = ridges_of_first(mesh);
  ASSERT_EQ(ridges.count, 1U);
  EXPECT_GT(ridges.sides[0].plane.normal.z, 0.9);
}

// The half-plane through the edge that halves the angle parts the goals: beyond it by more than the
// hysteresis the other side is nearer, before it none.
TEST(Ridges, TheNearerSideIsBeyondTheBisector) {
  for (const double degrees : {0.01, 1.0, 10.0, 29.0}) {
    const polygon::Ridges ridges = ridges_of_first(roof(degrees));
    const double half = glm::radians(0.5 * degrees), depth = 5e-3;
    // The ball's centre goes over the mitre of both planes.
    const dvec3 mitre(kRadius * std::tan(half), 0, kRadius);
    const dvec3 down(-std::sin(half), 0, -std::cos(half)), aside(std::cos(half), 0, -std::sin(half));
    const double reach = depth * std::tan(half);
    for (const double part : {-1.0, -0.1, 0.0}) {
      EXPECT_EQ(polygon::nearer_side(ridges, mitre + depth * down + part * reach * aside), nullptr);
    }
    for (const double part : {0.1, 0.5, 1.0, 3.0}) {
      const dvec3 goal = mitre + depth * down + part * reach * aside;
      const polygon::Ridges::Side* side = polygon::nearer_side(ridges, goal);
      ASSERT_NE(side, nullptr) << degrees << " " << part;
      EXPECT_EQ(side->element, 1U);
      const polygon::RidgeCrossing way = polygon::cross_ridge(ridges, *side, goal);
      EXPECT_LT(glm::length(way.top - mitre), 1e-16 / half);  // along the planes, as well as they meet
      EXPECT_LT(std::abs(way.top.z - kRadius), 1e-17);
      const dvec3 normal(std::sin(2 * half), 0, std::cos(2 * half));
      EXPECT_LT(glm::length(way.end - (goal - (glm::dot(normal, goal) - kRadius) * normal)), 1e-16);
    }
  }
}

TEST(Ridges, AGoalAboveASideIsNotHeldByIt) {
  const polygon::Ridges ridges = ridges_of_first(roof(20));
  EXPECT_EQ(polygon::nearer_side(ridges, {0.5, 0, kRadius - 1e-3}), nullptr);
}

TEST(Ridges, PrimitivesHaveNone) {
  const auto ball = polygon::make_ball_surface(0.01);
  EXPECT_EQ(polygon::ridges_of(*ball, 0, {{0, 0, 1}, 0.01}, kRadius, kRounding).count, 0U);
}

}  // namespace
