// SPDX-License-Identifier: GPL-3.0-or-later
// The optimality reference against closed forms.
#include "polygon/reference/optimality.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <stdexcept>
#include <vector>

#include "polygon/surface/primitives.h"
#include "tests/polygon/fixtures/brute_force.h"

namespace {

using namespace polygon;
using glm::dvec3;

TriangleMesh moved(TriangleMesh mesh, double scale, const dvec3& offset) {
  for (dvec3& v : mesh.vertices) v = v * scale + offset;
  return mesh;
}

void add_quad(TriangleMesh& mesh, const dvec3& a, const dvec3& b, const dvec3& c, const dvec3& d) {
  const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
  for (const dvec3& v : {a, b, c, d}) mesh.vertices.push_back(v);
  mesh.triangles.push_back({base, base + 1, base + 2});
  mesh.triangles.push_back({base, base + 2, base + 3});
}

// Three quarter planes that form a concave corner: x = 0, y = 0 and z = 0.
TriangleMesh concave_corner() {
  TriangleMesh mesh;
  const dvec3 o(0.0), x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
  add_quad(mesh, o, x, x + y, y);
  add_quad(mesh, o, y, y + z, z);
  add_quad(mesh, o, z, z + x, x);
  return mesh;
}

struct Placement {
  double scale;
  dvec3 offset;
};

class OptimalityPlaced : public testing::TestWithParam<Placement> {
 protected:
  [[nodiscard]] dvec3 at(const dvec3& p) const { return p * GetParam().scale + GetParam().offset; }
  [[nodiscard]] TriangleMesh at(const TriangleMesh& mesh) const {
    return moved(mesh, GetParam().scale, GetParam().offset);
  }
  // Error due to the skin and to rounding at these coordinates, for a mesh of size about 2.
  [[nodiscard]] double tolerance() const {
    return 1e-8 * GetParam().scale + 1e-12 * glm::length(GetParam().offset);
  }
  // Expects an error of 0 at the optimum. Beside the optimum the error has to equal the displacement.
  void expect_optimum(const OptimalityReference& reference, const dvec3& goal, const dvec3& optimum,
                      const dvec3& aside, double radius) const {
    const double s = GetParam().scale;
    for (const double away : {0.0, 1e-6, 1e-5, 1e-4, 1e-3}) {
      const NearestOptimum found =
          reference.nearest_optimum(at(goal), at(optimum + away * aside), radius * s, 0.1 * s);
      ASSERT_TRUE(found.found) << away;
      EXPECT_NEAR(found.error_m, away * s, tolerance()) << away;
      EXPECT_LT(glm::length(found.point - at(optimum)), tolerance()) << away;
    }
  }
};

INSTANTIATE_TEST_SUITE_P(Scales, OptimalityPlaced,
                         testing::Values(Placement{1.0, dvec3(0.0)}, Placement{1e-3, dvec3(0.0)},
                                         Placement{1e3, dvec3(0.0)}, Placement{0.1, dvec3(7, -3, 11)},
                                         Placement{1.0, dvec3(1e5, 2e5, -1e5)}));

TEST_P(OptimalityPlaced, BallAndPointOnBothSidesOfASheet) {
  const OptimalityReference reference(at(make_plane_mesh(1.0, 3)));
  for (const double radius : {0.0, 0.05}) {
    for (const double side : {1.0, -1.0}) {
      const dvec3 goal(0.123, 0.321, -0.2 * side);
      const dvec3 optimum(goal.x, goal.y, side * std::max(radius, 2e-9));
      expect_optimum(reference, goal, optimum, glm::normalize(dvec3(1, 0.2, 0)), radius);
      expect_optimum(reference, goal, optimum, dvec3(0, 0, side), radius);
      const NearestOptimum found =
          reference.nearest_optimum(at(goal), at(optimum + dvec3(0, 0, 1e-4 * side)),
                                    radius * GetParam().scale, 0.1 * GetParam().scale);
      EXPECT_NEAR(found.clearance_m, (1e-4 + std::abs(optimum.z) - radius) * GetParam().scale, tolerance());
    }
  }
}

TEST_P(OptimalityPlaced, EdgeAndCornerOfACube) {
  const OptimalityReference reference(at(make_box_mesh(dvec3(0.5), 3)));
  const double radius = 0.05;
  // The goal is outside the cube. The edge or the corner is nearest to it, and the ball rests there.
  const dvec3 goal(0.51, 0.13, 0.51);
  const dvec3 on_edge = dvec3(0.5, 0.13, 0.5) + radius * glm::normalize(dvec3(1, 0, 1));
  expect_optimum(reference, goal, on_edge, dvec3(0, 1, 0), radius);
  expect_optimum(reference, goal, on_edge, glm::normalize(dvec3(1, 0, 1)), radius);
  const dvec3 at_corner = dvec3(0.5) + radius * glm::normalize(dvec3(1));
  expect_optimum(reference, dvec3(0.51), at_corner, glm::normalize(dvec3(1)), radius);
  // The goal is inside the cube. The point above the edge is stationary too, although its balance is
  // unstable.
  expect_optimum(reference, dvec3(0.4, 0.13, 0.4), on_edge, dvec3(0, 1, 0), radius);
  expect_optimum(reference, dvec3(0.3, 0.13, 0.2), dvec3(0.3, 0.13, 0.55), dvec3(1, 0, 0), radius);
}

TEST_P(OptimalityPlaced, ConcaveCornerOfTwoAndThreePlanes) {
  const OptimalityReference reference(at(concave_corner()));
  for (const double radius : {0.0, 0.05}) {
    const double r = std::max(radius, 2e-9);
    expect_optimum(reference, dvec3(-0.1, 0.37, -0.07), dvec3(r, 0.37, r), dvec3(0, 1, 0), radius);
    expect_optimum(reference, dvec3(-0.1, 0.37, -0.07), dvec3(r, 0.37, r), dvec3(1, 0, 0), radius);
    expect_optimum(reference, dvec3(-0.1, -0.03, -0.07), dvec3(r), glm::normalize(dvec3(1, 2, 3)), radius);
    // The goal lies on the diagonal, where the mesh has edges.
    expect_optimum(reference, dvec3(-0.1), dvec3(r), dvec3(0, 1, 0), radius);
    expect_optimum(reference, dvec3(-0.1, 0.37, 0.37), dvec3(r, 0.37, 0.37), dvec3(0, 1, 0), radius);
  }
}

TEST_P(OptimalityPlaced, PointAndBallOnAFacetedSphere) {
  const TriangleMesh mesh = make_ball_mesh(1.0, 4);
  const OptimalityReference reference(at(mesh));
  std::mt19937_64 random(4);
  const double s = GetParam().scale;
  for (int i = 0; i < 60; ++i) {
    const dvec3 goal = 0.9 * tests::random_unit(random);
    // The nearest face is that with the least distance to its plane.
    double least = 2.0;
    dvec3 out(0.0);
    for (const TriangleIndices& t : mesh.triangles) {
      const dvec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
      const dvec3 n = glm::normalize(glm::cross(b - a, c - a));
      if (const double d = glm::dot(n, a - goal); d < least) {
        least = d;
        out = n;
      }
    }
    EXPECT_NEAR(reference.distance(at(goal)), least * s, tolerance());
    const dvec3 aside = glm::normalize(glm::cross(out, tests::random_unit(random)));
    for (const double radius : {0.0, 0.04}) {
      const dvec3 optimum = goal + (least + std::max(radius, 2e-9)) * out;
      EXPECT_LT(glm::length(reference.convex_optimum(at(goal), radius * s) - at(optimum)),
                tolerance() + 2e-8 * s);
      for (const double away : {0.0, 1e-6, 1e-5, 1e-4}) {
        // There are other stationary points at edges and corners, so the error may be smaller.
        const NearestOptimum found =
            reference.nearest_optimum(at(goal), at(optimum + away * aside), radius * s, 0.1 * s);
        ASSERT_TRUE(found.found);
        EXPECT_LE(found.error_m, away * s + tolerance());
        if (away <= 1e-5 && i != 0) {
          EXPECT_GE(found.error_m, 0.3 * away * s - tolerance());
        }
      }
    }
  }
}

TEST(Optimality, FreeProxyBelongsAtTheGoal) {
  const OptimalityReference reference(make_box_mesh(dvec3(0.5), 2));
  const dvec3 goal(0.9, 0.1, 0.2);
  const NearestOptimum there = reference.nearest_optimum(goal, goal, 0.05, 1e-3);
  EXPECT_TRUE(there.found);
  EXPECT_EQ(there.error_m, 0.0);
  EXPECT_NEAR(there.clearance_m, 0.35, 1e-15);
  // The goal is found at any distance, because nothing is in the way.
  const NearestOptimum far = reference.nearest_optimum(goal, dvec3(0.9, -3, 0.2), 0.05, 1e-3);
  EXPECT_TRUE(far.found);
  EXPECT_NEAR(far.error_m, 3.1, 1e-15);
  // The path may not cross the cube, nor pass an edge at less than the radius.
  EXPECT_FALSE(reference.nearest_optimum(goal, dvec3(-0.9, 0.1, 0.2), 0.05, 1e-3).found);
  EXPECT_FALSE(reference.nearest_optimum(dvec3(0.9, 0.0, 0.1), dvec3(0.0, 0.0, 1.0), 0.2, 1e-3).found);
  EXPECT_TRUE(reference.nearest_optimum(dvec3(0.9, 0.0, 0.4), dvec3(0.4, 0.0, 0.9), 0.1, 1e-3).found);
}

TEST(Optimality, AProxyTooFarOffIsNotFoundButHasAtLeastThatError) {
  const OptimalityReference reference(make_plane_mesh(1.0, 1));
  const NearestOptimum found = reference.nearest_optimum({0.5, 0, -0.3}, {0, 0, 0.05}, 0.05, 0.1);
  EXPECT_FALSE(found.found);
  EXPECT_EQ(found.error_m, 0.1);
  EXPECT_EQ(found.point, dvec3(0, 0, 0.05));
}

TEST(Optimality, OptimaAcrossASheetDoNotCountAndThoseAroundAnEdgeDo) {
  // The goal is above the sheet. For a proxy below the sheet, the optimum is at the sheet. For a proxy 10 nm
  // above the sheet, that optimum is 10 to 20 nm away, but it does not count, because it lies across the
  // sheet.
  const OptimalityReference sheet(make_plane_mesh(1.0, 1));
  const NearestOptimum across = sheet.nearest_optimum({0.1, 0.2, 0.3}, {0.1, 0.2, 1e-8}, 0.0, 1e-3);
  ASSERT_TRUE(across.found);
  EXPECT_NEAR(across.error_m, 0.3, 1e-7) << "it is free, and its goal is elsewhere";
  const NearestOptimum below = sheet.nearest_optimum({0.1, 0.2, 0.3}, {0.1, 0.2, -1e-8}, 0.0, 1e-3);
  ASSERT_TRUE(below.found);
  EXPECT_LT(below.error_m, 2e-8);
  // A point on top of a cube, 10 µm from the edge, with its optimum 10 µm down the side.
  const OptimalityReference cube(make_box_mesh(dvec3(0.5), 1));
  const NearestOptimum around =
      cube.nearest_optimum({0.4, 0.1, 0.5 - 1e-5}, {0.5 - 1e-5, 0.1, 0.5 + 1e-8}, 0.0, 1e-3);
  ASSERT_TRUE(around.found);
  EXPECT_LE(around.error_m, 1.5e-5);
}

TEST(Optimality, DegenerateAndDuplicateTrianglesChangeNothing) {
  TriangleMesh mesh = make_plane_mesh(1.0, 2);
  const std::vector<TriangleIndices> once = mesh.triangles;
  for (int copy = 0; copy < 20; ++copy) mesh.triangles.insert(mesh.triangles.end(), once.begin(), once.end());
  mesh.triangles.push_back({0, 0, 0});
  mesh.triangles.push_back({0, 1, 1});
  mesh.vertices.emplace_back(0.5 * (mesh.vertices[0] + mesh.vertices[1]));
  mesh.triangles.push_back({0, 1, static_cast<std::uint32_t>(mesh.vertices.size() - 1)});
  const OptimalityReference reference(mesh);
  for (const double radius : {0.0, 0.1}) {
    const double z = std::max(radius, 2e-9);
    for (const dvec3 place : {dvec3(0, 0, z), dvec3(0.3, 0.3, z), dvec3(-1, -1, z), dvec3(0, 0.5, z)}) {
      const dvec3 goal(place.x, place.y, -0.2);
      const NearestOptimum found = reference.nearest_optimum(goal, place + dvec3(1e-5, 0, 0), radius, 1e-3);
      ASSERT_TRUE(found.found);
      EXPECT_LE(found.error_m, 1e-5 + 1e-8);
      EXPECT_NEAR(reference.distance(place), z, 1e-15);
    }
  }
  EXPECT_FALSE(reference.inside({0, 0, 0}));
}

TEST(Optimality, RefusesWhatHasNoAnswer) {
  EXPECT_THROW(OptimalityReference(TriangleMesh{}), std::invalid_argument);
  TriangleMesh mesh = make_plane_mesh(1.0, 1);
  mesh.triangles.push_back({0, 1, 99});
  EXPECT_THROW(OptimalityReference{mesh}, std::invalid_argument);
  mesh.triangles.pop_back();
  const OptimalityReference reference(mesh);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(reference.nearest_optimum({nan, 0, 0}, {0, 0, 1}, 0.1, 1e-3).found);
  EXPECT_GT(reference.nearest_optimum({0, 0, 1}, {0, nan, 1}, 0.1, 1e-3).error_m, 1e300);
  EXPECT_THROW((void)reference.nearest_optimum({0, 0, 0}, {0, 0, 1}, -0.1, 1e-3), std::invalid_argument);
  EXPECT_TRUE(std::isnan(reference.distance({nan, 0, 0})));
  EXPECT_FALSE(reference.inside({nan, 0, 0}));
  mesh.vertices[0].x = nan;
  EXPECT_THROW(OptimalityReference{mesh}, std::invalid_argument);
}

TEST(Optimality, InsideIsTheWindingNumber) {
  TriangleMesh mesh = make_ball_mesh(1.0, 2);
  std::mt19937_64 random(9);
  for (dvec3& v : mesh.vertices) v *= 1.0 + 0.3 * std::sin(5.0 * v.x) * std::cos(4.0 * v.y);
  const OptimalityReference reference(mesh);
  int in = 0;
  for (int i = 0; i < 500; ++i) {
    const dvec3 p = tests::random_point(random, 1.2);
    const bool expected = tests::winding_number(p, mesh) > 0.5;
    ASSERT_EQ(reference.inside(p), expected);
    in += expected ? 1 : 0;
  }
  EXPECT_GT(in, 100);
  EXPECT_TRUE(reference.inside(dvec3(0.0)));
  EXPECT_FALSE(reference.inside(mesh.vertices[3])) << "on the surface";
}

}  // namespace
