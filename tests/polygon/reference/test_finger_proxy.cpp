// SPDX-License-Identifier: GPL-3.0-or-later
// The published proxy with constraint planes against closed forms (plane, box, corner), and its collision
// detection against conservative advancement, which needs distances alone.
#include "polygon/reference/finger_proxy.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <random>
#include <stdexcept>

#include "polygon/reference/near_triangle.h"
#include "polygon/reference/triangle_tree.h"

namespace {

using glm::dvec3;
using polygon::finger_step;
using polygon::FingerStep;
using polygon::SweptHit;
using polygon::TriangleMesh;
using polygon::TriangleTree;

constexpr double kBall_m = 0.002;
constexpr double kHalf_m = 0.05;               // half edge of the box
constexpr std::uint32_t kUntilItStands = 200;  // passes

dvec3 random_in_cube(std::mt19937_64& random, double half) {
  std::uniform_real_distribution<double> at(-half, half);
  const double x = at(random), y = at(random), z = at(random);
  return {x, y, z};
}

void add_quad(TriangleMesh& mesh, const dvec3& a, const dvec3& b, const dvec3& c, const dvec3& d) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), {a, b, c, d});
  mesh.triangles.push_back({first, first + 1, first + 2});
  mesh.triangles.push_back({first, first + 2, first + 3});
}

TriangleMesh plane_mesh() {  // z = 0
  TriangleMesh mesh;
  add_quad(mesh, {-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0});
  return mesh;
}

// The three quarter planes x, y, z = 0 of a corner that is open where all are positive.
TriangleMesh corner_mesh() {
  TriangleMesh mesh;
  add_quad(mesh, {0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0});
  add_quad(mesh, {0, 0, 0}, {0, 1, 0}, {0, 1, 1}, {0, 0, 1});
  add_quad(mesh, {0, 0, 0}, {0, 0, 1}, {1, 0, 1}, {1, 0, 0});
  return mesh;
}

TriangleMesh box_mesh() {
  TriangleMesh mesh;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-kHalf_m, kHalf_m}) {
      const auto place = [&](double u, double v) {
        dvec3 p;
        p[axis] = side;
        p[(axis + 1) % 3] = u * kHalf_m;
        p[(axis + 2) % 3] = v * kHalf_m;
        return p;
      };
      add_quad(mesh, place(-1, -1), place(1, -1), place(1, 1), place(-1, 1));
    }
  }
  return mesh;
}

TriangleMesh random_soup(std::mt19937_64& random, int triangles) {
  TriangleMesh mesh;
  for (int n = 0; n < triangles; ++n) {
    const dvec3 middle = random_in_cube(random, 1.0);
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (int i = 0; i < 3; ++i) mesh.vertices.push_back(middle + random_in_cube(random, 0.3));
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
  return mesh;
}

double distance(const TriangleMesh& mesh, const dvec3& p) {
  long double least = 1e30L;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& [a, b, c] = mesh.triangles[i];
    const auto triangle =
        polygon::near_triangle(i, {mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]}, p);
    least = std::min(least, polygon::closest_on(triangle, polygon::FineVec(0.0L)).distance);
  }
  return static_cast<double>(least);
}

// The fraction of the way at which the distance falls to the radius, or more than 1 if it never does. No step
// is longer than the distance that is left, so none passes the contact (conservative advancement).
double meets_at(const TriangleMesh& mesh, const dvec3& from, const dvec3& to, double radius) {
  const double length = glm::length(to - from);
  double part = 0.0;
  for (int n = 0; n < 2000 && part <= 1.0; ++n) {
    const double room = distance(mesh, from + part * (to - from)) - radius;
    if (room < 1e-10) return part;
    part += room / length;
  }
  return part;
}

FingerStep settle(const TriangleTree& tree, double radius, const dvec3& from, const dvec3& goal) {
  return finger_step(tree, {.radius_m = radius, .passes = kUntilItStands}, from, goal);
}

TEST(TriangleTree, ABallStopsWhereItsDistanceFallsToTheRadius) {
  std::mt19937_64 random(7);
  int hits = 0;
  for (int soup = 0; soup < 10; ++soup) {
    const TriangleMesh mesh = random_soup(random, 40);
    const TriangleTree tree(mesh);
    for (int n = 0; n < 60; ++n) {
      const double radius = n % 2 == 0 ? 0.05 : 0.2;
      const dvec3 from = random_in_cube(random, 2.0), to = random_in_cube(random, 1.5);
      if (distance(mesh, from) < radius + 1e-3) continue;
      const double expected = meets_at(mesh, from, to, radius);
      const SweptHit hit = tree.first_hit(from, to, radius);
      if (!hit.hit) {
        EXPECT_GT(expected, 1.0 - 1e-6);
        continue;
      }
      ++hits;
      // Advancement stops within 1e-10 of the radius. Where the ball grazes, this is well before the contact.
      const dvec3 at = from + hit.part * (to - from);
      EXPECT_NEAR(distance(mesh, at), radius, 1e-9);
      EXPECT_GE(hit.part, expected - 1e-9);
      EXPECT_NEAR(hit.part, expected, 1e-4);
      EXPECT_NEAR(distance(mesh, at - radius * hit.normal), 0.0, 1e-8) << "the normal ends at the contact";
    }
  }
  EXPECT_GT(hits, 200);
}

TEST(TriangleTree, APointStopsAtTheSheet) {
  const TriangleTree tree(plane_mesh());
  const SweptHit hit = tree.first_hit({0.1, 0.2, 0.3}, {0.1, 0.2, -0.1}, 0.0);
  ASSERT_TRUE(hit.hit);
  EXPECT_NEAR(hit.part, 0.75, 1e-15);
  EXPECT_EQ(hit.normal, dvec3(0.0, 0.0, 1.0));
  EXPECT_EQ(tree.first_hit({0.1, 0.2, -0.3}, {0.1, 0.2, 0.1}, 0.0).normal, dvec3(0.0, 0.0, -1.0));
  EXPECT_FALSE(tree.first_hit({0.1, 0.2, 0.3}, {0.1, 0.2, 0.1}, 0.0).hit);
  EXPECT_FALSE(tree.first_hit({2.0, 0.2, 0.3}, {2.0, 0.2, -0.1}, 0.0).hit) << "beside the sheet";
  EXPECT_TRUE(tree.first_hit({0.3, 0.3, 0.1}, {0.3, 0.3, -0.1}, 0.0).hit) << "the common side of two";
  EXPECT_THROW(TriangleTree(TriangleMesh{}), std::invalid_argument);
}

TEST(FingerProxy, OnAPlaneTheForceIsStiffnessTimesDepth) {
  constexpr double kStiffness_N_per_m = 1000.0;
  const TriangleTree tree(plane_mesh());
  std::mt19937_64 random(3);
  for (const double radius : {0.0, kBall_m}) {
    for (const std::uint32_t passes : {1U, kUntilItStands}) {
      dvec3 proxy(0.0, 0.0, 0.1);
      for (int n = 0; n < 500; ++n) {
        dvec3 goal = random_in_cube(random, 0.3);
        goal.z = 0.2 * goal.z - 0.02;
        proxy = finger_step(tree, {.radius_m = radius, .passes = passes}, proxy, goal).point;
        const dvec3 force = kStiffness_N_per_m * (proxy - goal);
        const double depth = std::max(0.0, radius - goal.z);
        EXPECT_NEAR(force.z, kStiffness_N_per_m * depth, 1e-3);
        EXPECT_NEAR(force.x, 0.0, 1e-9);
        EXPECT_NEAR(force.y, 0.0, 1e-9);
      }
    }
  }
}

TEST(FingerProxy, InACornerItEndsAtTheNearestFreePlace) {
  const TriangleTree tree(corner_mesh());
  std::mt19937_64 random(5);
  for (const double radius : {0.0, kBall_m}) {
    dvec3 proxy(0.1);
    for (int n = 0; n < 1000; ++n) {
      const dvec3 goal = random_in_cube(random, 0.05) + 0.02;
      const FingerStep step = settle(tree, radius, proxy, goal);
      proxy = step.point;
      EXPECT_TRUE(step.settled);
      EXPECT_LT(glm::length(proxy - glm::max(goal, dvec3(radius))), 1e-6) << n;
    }
  }
}

// Goals beside a face, an edge and a vertex of the box. The closest point of the box lies on this feature.
TEST(FingerProxy, AtABoxItEndsAtTheClosestPoint) {
  const TriangleTree tree(box_mesh());
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> part(0.1, 0.8);
  for (int feature = 1; feature <= 3; ++feature) {  // number of axes on which the goal is outside the box
    for (int n = 0; n < 300; ++n) {
      dvec3 goal = random_in_cube(random, 0.9 * kHalf_m);
      for (int axis = 0; axis < feature; ++axis) goal[axis] = kHalf_m + part(random) * 0.5 * kBall_m;
      const dvec3 closest = glm::clamp(goal, dvec3(-kHalf_m), dvec3(kHalf_m));
      const dvec3 away = glm::normalize(goal - closest);
      const dvec3 expected = closest + kBall_m * away;
      const dvec3 start = closest + 0.01 * glm::normalize(away + random_in_cube(random, 0.3));
      const FingerStep step = settle(tree, kBall_m, start, goal);
      EXPECT_TRUE(step.settled);
      EXPECT_LT(glm::length(step.point - expected), 1e-6) << feature << ", " << n;
    }
  }
}

TEST(FingerProxy, OffAFaceItGoesRoundTheEdge) {
  const TriangleTree tree(box_mesh());
  for (const double radius : {0.0, kBall_m}) {
    dvec3 proxy(0.03, 0.0, 0.06);
    const auto go = [&](const dvec3& goal) { return proxy = settle(tree, radius, proxy, goal).point; };
    EXPECT_LT(glm::length(go({0.03, 0.0, 0.045}) - dvec3(0.03, 0.0, kHalf_m + radius)), 1e-6);
    EXPECT_LT(glm::length(go({0.049, 0.0, 0.045}) - dvec3(0.049, 0.0, kHalf_m + radius)), 1e-6);
    const dvec3 beyond(0.06, 0.0, 0.045);
    EXPECT_LT(glm::length(go(beyond) - beyond), 1e-6);
    EXPECT_LT(glm::length(go({0.045, 0.0, 0.02}) - dvec3(kHalf_m + radius, 0.0, 0.02)), 1e-6);
  }
}

// Without the gap, a proxy on a face would be stopped by the rim of the next face, as at a concave edge.
TEST(FingerProxy, AGoalOnTheFaceItselfKeepsTheGap) {
  const TriangleTree tree(box_mesh());
  dvec3 proxy(0.04, 0.0, 0.06);
  for (const dvec3& goal : {dvec3(0.04, 0.0, kHalf_m), dvec3(0.049, 0.0, 0.045), dvec3(0.051, 0.0, 0.045)})
    proxy = settle(tree, 0.0, proxy, goal).point;
  EXPECT_EQ(proxy, dvec3(0.051, 0.0, 0.045));
}

TEST(FingerProxy, WhereverTheGoalJumpsNoTriangleIsEntered) {
  const TriangleMesh mesh = box_mesh();
  const TriangleTree tree(mesh);
  std::mt19937_64 random(11);
  for (const std::uint32_t passes : {1U, kUntilItStands}) {
    dvec3 proxy(0.0, 0.0, 0.1);
    for (int n = 0; n < 3000; ++n) {
      proxy = finger_step(tree, {.radius_m = kBall_m, .passes = passes}, proxy, random_in_cube(random, 0.08))
                  .point;
      ASSERT_GE(distance(mesh, proxy), kBall_m * (1.0 - 1e-9)) << n;
      ASSERT_GT(std::max({std::fabs(proxy.x), std::fabs(proxy.y), std::fabs(proxy.z)}), kHalf_m) << n;
    }
  }
}

}  // namespace
