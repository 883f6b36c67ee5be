// SPDX-License-Identifier: GPL-3.0-or-later
// Adjacency across a triangle's edges, and the path over a nearly flat edge.
#include "polygon/proxy/edge_crossing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <map>
#include <random>
#include <set>

#include "polygon/mesh/topology.h"
#include "polygon/surface/mesh_surface.h"
#include "polygon/surface/primitives.h"

namespace {

using glm::dvec3;
using polygon::TriangleIndices;
using polygon::TriangleMesh;

constexpr double kRadius = 1e-3, kRounding = 1e-16;

// Two triangles that share an edge along y at the origin. The second one slopes down by `degrees` towards +x.
TriangleMesh roof(double degrees) {
  const double bend = glm::radians(degrees);
  TriangleMesh mesh;
  mesh.vertices = {{0, -1, 0}, {0, 1, 0}, {-1, 0, 0}, {std::cos(bend), 0, -std::sin(bend)}};
  mesh.triangles = {{0, 1, 2}, {1, 0, 3}};
  return mesh;
}

polygon::CrossableEdges crossable_edges_of_first(const TriangleMesh& mesh, const dvec3& up = {0, 0, 1}) {
  const auto surface = polygon::make_mesh_surface(mesh, false);
  return polygon::crossable_edges_of(*surface, 0, {up, kRadius}, kRadius, kRounding);
}

TEST(TrianglesAcross, AreThoseThatShareBothCorners) {
  std::mt19937_64 random(3);
  for (int round = 0; round < 20; ++round) {
    // A random soup over a few points: edges with one, two and more triangles, and repeated corners.
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

TEST(CrossableEdges, AreConvexAndNearlyFlat) {
  for (const double degrees : {0.01, 1.0, 29.0})
    EXPECT_EQ(crossable_edges_of_first(roof(degrees)).count, 1U) << degrees;
  for (const double degrees : {0.0, 31.0, 60.0, 90.0, 150.0, -0.01, -1.0, -29.0, -90.0})
    EXPECT_EQ(crossable_edges_of_first(roof(degrees)).count, 0U) << degrees;
}

TEST(CrossableEdges, FromBelowAValleyIsARidge) {
  EXPECT_EQ(crossable_edges_of_first(roof(-10), {0, 0, -1}).count, 1U);
  EXPECT_EQ(crossable_edges_of_first(roof(10), {0, 0, -1}).count, 0U);
}

TEST(CrossableEdges, TrianglesNeedNotBeOrientedAlike) {
  TriangleMesh mesh = roof(10);
  std::swap(mesh.triangles[1][0], mesh.triangles[1][1]);
  const polygon::CrossableEdges edges = crossable_edges_of_first(mesh);
  ASSERT_EQ(edges.count, 1U);
  EXPECT_GT(edges.sides[0].plane.normal.z, 0.9);
}

// The bisecting plane of the two offset planes divides the goals. If a goal lies beyond it by more than the
// hysteresis, the other side is nearer. If the goal lies before it, no other side is nearer.
TEST(CrossableEdges, TheNearerSideIsBeyondTheBisector) {
  for (const double degrees : {0.01, 1.0, 10.0, 29.0}) {
    const polygon::CrossableEdges edges = crossable_edges_of_first(roof(degrees));
    const double half = glm::radians(0.5 * degrees), depth = 5e-3;
    // The ball's centre crosses where the two offset planes meet.
    const dvec3 mitre(kRadius * std::tan(half), 0, kRadius);
    const dvec3 down(-std::sin(half), 0, -std::cos(half)), aside(std::cos(half), 0, -std::sin(half));
    const double reach = depth * std::tan(half);
    for (const double part : {-1.0, -0.1, 0.0}) {
      EXPECT_EQ(polygon::nearer_side(edges, mitre + depth * down + part * reach * aside), nullptr);
    }
    for (const double part : {0.1, 0.5, 1.0, 3.0}) {
      const dvec3 goal = mitre + depth * down + part * reach * aside;
      const polygon::CrossableEdges::Side* side = polygon::nearer_side(edges, goal);
      ASSERT_NE(side, nullptr) << degrees << " " << part;
      EXPECT_EQ(side->element, 1U);
      const polygon::EdgeCrossing way = polygon::cross_edge(edges, *side, goal);
      // The planes' line of intersection is defined no better than this, because the planes meet at a small
      // angle.
      EXPECT_LT(glm::length(way.top - mitre), 1e-16 / half);
      EXPECT_LT(std::abs(way.top.z - kRadius), 1e-17);
      const dvec3 normal(std::sin(2 * half), 0, std::cos(2 * half));
      EXPECT_LT(glm::length(way.end - (goal - (glm::dot(normal, goal) - kRadius) * normal)), 1e-16);
    }
  }
}

TEST(CrossableEdges, AGoalAboveASideIsNotHeldByIt) {
  const polygon::CrossableEdges edges = crossable_edges_of_first(roof(20));
  EXPECT_EQ(polygon::nearer_side(edges, {0.5, 0, kRadius - 1e-3}), nullptr);
}

TEST(CrossableEdges, PrimitivesHaveNone) {
  const auto ball = polygon::make_ball_surface(0.01);
  EXPECT_EQ(polygon::crossable_edges_of(*ball, 0, {{0, 0, 1}, 0.01}, kRadius, kRounding).count, 0U);
}

}  // namespace
