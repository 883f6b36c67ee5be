// SPDX-License-Identifier: GPL-3.0-or-later
// The reference is itself held against closed forms, and against optima found by means that have nothing in
// common with it.
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

// Three quarter planes, x = 0, y = 0 and z = 0, that look at one another.
TriangleMesh concave_corner() {
  TriangleMesh mesh;
  const dvec3 o(0.0), x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
  add_quad(mesh, o, x, x + y, y);
  add_quad(mesh, o, y, y + z, z);
  add_quad(mesh, o, z, z + x, x);
  return mesh;
}

double mesh_distance(const dvec3& p, const TriangleMesh& mesh) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    least = std::min(least, tests::triangle_distance(p, mesh, t));
  }
  return least;
}

dvec3 random_unit(std::mt19937_64& random) {
  for (;;) {
    const dvec3 v = tests::random_point(random, 1.0);
    if (const double l = glm::length(v); l > 0.1 && l < 1.0) return v / l;
  }
}

struct Placement {
  double scale;
  dvec3 offset;
};

class FirstOrderPlaced : public testing::TestWithParam<Placement> {
 protected:
  [[nodiscard]] dvec3 at(const dvec3& p) const { return p * GetParam().scale + GetParam().offset; }
  [[nodiscard]] TriangleMesh at(const TriangleMesh& mesh) const {
    return moved(mesh, GetParam().scale, GetParam().offset);
  }
  // What the skin and coordinates of that size leave open, for a mesh of size about 2.
  [[nodiscard]] double tolerance() const {
    return 1e-8 * GetParam().scale + 1e-12 * glm::length(GetParam().offset);
  }
  // The optimum itself has no error, and one beside it has as much as it was moved.
  void expect_optimum(const FirstOrderReference& reference, const dvec3& goal, const dvec3& optimum,
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

INSTANTIATE_TEST_SUITE_P(Scales, FirstOrderPlaced,
                         testing::Values(Placement{1.0, dvec3(0.0)}, Placement{1e-3, dvec3(0.0)},
                                         Placement{1e3, dvec3(0.0)}, Placement{0.1, dvec3(7, -3, 11)},
                                         Placement{1.0, dvec3(1e5, 2e5, -1e5)}));

TEST_P(FirstOrderPlaced, BallAndPointOnBothSidesOfASheet) {
  const FirstOrderReference reference(at(make_plane_mesh(1.0, 3)));
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

TEST_P(FirstOrderPlaced, EdgeAndCornerOfACube) {
  const FirstOrderReference reference(at(make_box_mesh(dvec3(0.5), 3)));
  const double radius = 0.05;
  // Outside, so that the edge and the corner are what is nearest: the ball rests against them.
  const dvec3 goal(0.51, 0.13, 0.51);
  const dvec3 on_edge = dvec3(0.5, 0.13, 0.5) + radius * glm::normalize(dvec3(1, 0, 1));
  expect_optimum(reference, goal, on_edge, dvec3(0, 1, 0), radius);
  expect_optimum(reference, goal, on_edge, glm::normalize(dvec3(1, 0, 1)), radius);
  const dvec3 at_corner = dvec3(0.5) + radius * glm::normalize(dvec3(1));
  expect_optimum(reference, dvec3(0.51), at_corner, glm::normalize(dvec3(1)), radius);
  // Inside: balanced on the edge is stationary too, though nothing would stay there.
  expect_optimum(reference, dvec3(0.4, 0.13, 0.4), on_edge, dvec3(0, 1, 0), radius);
  expect_optimum(reference, dvec3(0.3, 0.13, 0.2), dvec3(0.3, 0.13, 0.55), dvec3(1, 0, 0), radius);
}

TEST_P(FirstOrderPlaced, ConcaveCornerOfTwoAndThreePlanes) {
  const FirstOrderReference reference(at(concave_corner()));
  for (const double radius : {0.0, 0.05}) {
    const double r = std::max(radius, 2e-9);
    expect_optimum(reference, dvec3(-0.1, 0.37, -0.07), dvec3(r, 0.37, r), dvec3(0, 1, 0), radius);
    expect_optimum(reference, dvec3(-0.1, 0.37, -0.07), dvec3(r, 0.37, r), dvec3(1, 0, 0), radius);
    expect_optimum(reference, dvec3(-0.1, -0.03, -0.07), dvec3(r), glm::normalize(dvec3(1, 2, 3)), radius);
    expect_optimum(reference, dvec3(-0.1), dvec3(r), dvec3(0, 1, 0), radius);  // by the meshes' own edges
    expect_optimum(reference, dvec3(-0.1, 0.37, 0.37), dvec3(r, 0.37, 0.37), dvec3(0, 1, 0), radius);
  }
}

TEST_P(FirstOrderPlaced, PointAndBallOnAFacetedSphere) {
  const TriangleMesh mesh = make_ball_mesh(1.0, 4);
  const FirstOrderReference reference(at(mesh));
  std::mt19937_64 random(4);
  const double s = GetParam().scale;
  for (int i = 0; i < 60; ++i) {
    const dvec3 goal = 0.9 * random_unit(random);
    // The nearest face's plane: the least of the planes' distances.
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
    const dvec3 aside = glm::normalize(glm::cross(out, random_unit(random)));
    for (const double radius : {0.0, 0.04}) {
      const dvec3 optimum = goal + (least + std::max(radius, 2e-9)) * out;
      EXPECT_LT(glm::length(reference.convex_optimum(at(goal), radius * s) - at(optimum)),
                tolerance() + 2e-8 * s);
      for (const double away : {0.0, 1e-6, 1e-5, 1e-4}) {
        // Edges and corners have stationary points of their own, so it may be less.
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

TEST(FirstOrder, FreeProxyBelongsAtTheGoal) {
  const FirstOrderReference reference(make_box_mesh(dvec3(0.5), 2));
  const dvec3 goal(0.9, 0.1, 0.2);
  const NearestOptimum there = reference.nearest_optimum(goal, goal, 0.05, 1e-3);
  EXPECT_TRUE(there.found);
  EXPECT_EQ(there.error_m, 0.0);
  EXPECT_NEAR(there.clearance_m, 0.35, 1e-15);
  // However far: nothing holds it.
  const NearestOptimum far = reference.nearest_optimum(goal, dvec3(0.9, -3, 0.2), 0.05, 1e-3);
  EXPECT_TRUE(far.found);
  EXPECT_NEAR(far.error_m, 3.1, 1e-15);
  // Through the cube it may not go, nor closer past an edge than the radius.
  EXPECT_FALSE(reference.nearest_optimum(goal, dvec3(-0.9, 0.1, 0.2), 0.05, 1e-3).found);
  EXPECT_FALSE(reference.nearest_optimum(dvec3(0.9, 0.0, 0.1), dvec3(0.0, 0.0, 1.0), 0.2, 1e-3).found);
  EXPECT_TRUE(reference.nearest_optimum(dvec3(0.9, 0.0, 0.4), dvec3(0.4, 0.0, 0.9), 0.1, 1e-3).found);
}

TEST(FirstOrder, AProxyTooFarOffIsNotFoundButHasAtLeastThatError) {
  const FirstOrderReference reference(make_plane_mesh(1.0, 1));
  const NearestOptimum found = reference.nearest_optimum({0.5, 0, -0.3}, {0, 0, 0.05}, 0.05, 0.1);
  EXPECT_FALSE(found.found);
  EXPECT_EQ(found.error_m, 0.1);
  EXPECT_EQ(found.point, dvec3(0, 0, 0.05));
}

TEST(FirstOrder, OptimaAcrossASheetDoNotCountAndThoseAroundAnEdgeDo) {
  // Pressing up from below and standing on top: the optimum below is 20 nm away and out of reach.
  const FirstOrderReference sheet(make_plane_mesh(1.0, 1));
  const NearestOptimum across = sheet.nearest_optimum({0.1, 0.2, 0.3}, {0.1, 0.2, 1e-8}, 0.0, 1e-3);
  ASSERT_TRUE(across.found);
  EXPECT_NEAR(across.error_m, 0.3, 1e-7) << "it is free, and its goal is elsewhere";
  const NearestOptimum below = sheet.nearest_optimum({0.1, 0.2, 0.3}, {0.1, 0.2, -1e-8}, 0.0, 1e-3);
  ASSERT_TRUE(below.found);
  EXPECT_LT(below.error_m, 2e-8);
  // A point on the top of a cube, 10 µm from the edge, whose optimum lies 10 µm down the side.
  const FirstOrderReference cube(make_box_mesh(dvec3(0.5), 1));
  const NearestOptimum around =
      cube.nearest_optimum({0.4, 0.1, 0.5 - 1e-5}, {0.5 - 1e-5, 0.1, 0.5 + 1e-8}, 0.0, 1e-3);
  ASSERT_TRUE(around.found);
  EXPECT_LE(around.error_m, 1.5e-5);
}

TEST(FirstOrder, DegenerateAndDuplicateTrianglesChangeNothing) {
  TriangleMesh mesh = make_plane_mesh(1.0, 2);
  const std::vector<TriangleIndices> once = mesh.triangles;
  for (int copy = 0; copy < 20; ++copy) mesh.triangles.insert(mesh.triangles.end(), once.begin(), once.end());
  mesh.triangles.push_back({0, 0, 0});
  mesh.triangles.push_back({0, 1, 1});
  mesh.vertices.emplace_back(0.5 * (mesh.vertices[0] + mesh.vertices[1]));
  mesh.triangles.push_back({0, 1, static_cast<std::uint32_t>(mesh.vertices.size() - 1)});
  const FirstOrderReference reference(mesh);
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

TEST(FirstOrder, RefusesWhatHasNoAnswer) {
  EXPECT_THROW(FirstOrderReference(TriangleMesh{}), std::invalid_argument);
  TriangleMesh mesh = make_plane_mesh(1.0, 1);
  mesh.triangles.push_back({0, 1, 99});
  EXPECT_THROW(FirstOrderReference{mesh}, std::invalid_argument);
  mesh.triangles.pop_back();
  const FirstOrderReference reference(mesh);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(reference.nearest_optimum({nan, 0, 0}, {0, 0, 1}, 0.1, 1e-3).found);
  EXPECT_GT(reference.nearest_optimum({0, 0, 1}, {0, nan, 1}, 0.1, 1e-3).error_m, 1e300);
  EXPECT_THROW((void)reference.nearest_optimum({0, 0, 0}, {0, 0, 1}, -0.1, 1e-3), std::invalid_argument);
  EXPECT_TRUE(std::isnan(reference.distance({nan, 0, 0})));
  EXPECT_FALSE(reference.inside({nan, 0, 0}));
  mesh.vertices[0].x = nan;
  EXPECT_THROW(FirstOrderReference{mesh}, std::invalid_argument);
}

TEST(FirstOrder, InsideIsTheWindingNumber) {
  TriangleMesh mesh = make_ball_mesh(1.0, 2);
  std::mt19937_64 random(9);
  for (dvec3& v : mesh.vertices) v *= 1.0 + 0.3 * std::sin(5.0 * v.x) * std::cos(4.0 * v.y);
  const FirstOrderReference reference(mesh);
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

// A terrain and a goal below it. What a point can be held by is a local minimum of the distance over the
// surface: a face that the goal is above or below of, a valley, a pit; a saddle of the terrain where it is
// one. Each is found by derivatives along the surface, from the geometry without any skin.
class Terrain {
 public:
  explicit Terrain(std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> u(-1.0, 1.0);
    for (std::uint32_t y = 0; y < kSide; ++y) {
      for (std::uint32_t x = 0; x < kSide; ++x) {
        mesh.vertices.emplace_back(x + 0.2 * u(random), y + 0.2 * u(random), 0.6 * u(random));
      }
    }
    for (std::uint32_t y = 0; y + 1 < kSide; ++y) {
      for (std::uint32_t x = 0; x + 1 < kSide; ++x) {
        const std::uint32_t a = y * kSide + x;
        mesh.triangles.push_back({a, a + 1, a + kSide + 1});
        mesh.triangles.push_back({a, a + kSide + 1, a + kSide});
      }
    }
  }

  // Local minima of |q − goal| over the surface, away from its rim, with a way up out of the surface there.
  [[nodiscard]] std::vector<dvec3> minima(const dvec3& goal) const {
    std::vector<dvec3> found;
    const auto consider = [&](const dvec3& q) {
      if (q.x < 1.2 || q.y < 1.2 || q.x > kSide - 2.2 || q.y > kSide - 2.2) return;
      for (const dvec3& other : found) {
        if (glm::length(other - q) < 1e-9) return;
      }
      const double here = glm::length(q - goal);
      // A convex function over each triangle: its slope from q towards any other place of the triangle is
      // least towards the triangle's own nearest point.
      for (const TriangleIndices& t : mesh.triangles) {
        if (tests::triangle_distance(q, mesh, static_cast<std::size_t>(&t - mesh.triangles.data())) > 1e-12) {
          continue;
        }
        if (tests::triangle_distance(goal, mesh, static_cast<std::size_t>(&t - mesh.triangles.data())) <
            here - 1e-12) {
          return;
        }
      }
      found.push_back(q);
    };
    for (const TriangleIndices& t : mesh.triangles) {
      const dvec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
      const dvec3 n = glm::normalize(glm::cross(b - a, c - a));
      const dvec3 foot = goal - n * glm::dot(n, goal - a);
      if (tests::triangle_distance(foot, mesh, static_cast<std::size_t>(&t - mesh.triangles.data())) <
          1e-14) {
        consider(foot);
      }
      for (const auto& [p, q] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)}) {
        const double along = glm::dot(goal - p, q - p) / glm::dot(q - p, q - p);
        if (along > 0.0 && along < 1.0) consider(p + along * (q - p));
      }
      for (const dvec3& v : {a, b, c}) consider(v);
    }
    return found;
  }

  static constexpr std::uint32_t kSide = 8;
  TriangleMesh mesh;
};

TEST(FirstOrder, PointsInTheValleysAndPitsOfATerrain) {
  int pits = 0, total = 0;
  for (std::uint64_t seed = 1; seed <= 25; ++seed) {
    const Terrain terrain(seed);
    const FirstOrderReference reference(terrain.mesh);
    std::mt19937_64 random(seed);
    for (int i = 0; i < 8; ++i) {
      const dvec3 goal = dvec3(3.5, 3.5, -1.5) + tests::random_point(random, 0.7);
      for (const dvec3& optimum : terrain.minima(goal)) {
        ++total;
        for (const dvec3& v : terrain.mesh.vertices) pits += v == optimum ? 1 : 0;
        // The way out that is furthest from all faces around.
        dvec3 out(0.0);
        for (int n = 0; n < 50; ++n) {
          for (std::size_t t = 0; t < terrain.mesh.triangles.size(); ++t) {
            if (tests::triangle_distance(optimum, terrain.mesh, t) > 1e-12) continue;
            const TriangleIndices& f = terrain.mesh.triangles[t];
            const dvec3& a = terrain.mesh.vertices[f[0]];
            const dvec3 normal =
                glm::normalize(glm::cross(terrain.mesh.vertices[f[1]] - a, terrain.mesh.vertices[f[2]] - a));
            if (const double height = glm::dot(out, normal); height < 1.0) out += (1.0 - height) * normal;
          }
        }
        for (const double away : {1e-7, 1e-5, 1e-3}) {
          const NearestOptimum found = reference.nearest_optimum(goal, optimum + away * out, 0.0, 0.1);
          ASSERT_TRUE(found.found) << "seed " << seed << " at " << optimum.x << ' ' << optimum.y;
          EXPECT_LE(found.error_m, away * glm::length(out) * (1.0 + 1e-6) + 1e-7) << "seed " << seed;
        }
      }
    }
  }
  EXPECT_GT(total, 300);
  EXPECT_GT(pits, 15);
}

// Augmented Lagrangian (Nocedal & Wright, Numerical Optimization, 17.3) with plain gradient steps: slow, and
// knows of triangles nothing but their distance.
struct Descent {
  dvec3 point{0.0};
  double residual = 0.0;  // of the multipliers' force balance
  double depth = 0.0;     // in the deepest triangle
};

Descent descend(const TriangleMesh& mesh, const dvec3& goal, const dvec3& start, double radius) {
  const auto closest = [&](const dvec3& q, std::size_t t) {
    // By its distance alone: central differences of an exact distance would be rough, so by projection.
    const TriangleIndices& f = mesh.triangles[t];
    const dvec3 &a = mesh.vertices[f[0]], &b = mesh.vertices[f[1]], &c = mesh.vertices[f[2]];
    dvec3 w(1.0 / 3.0);
    const dvec3 n = glm::cross(b - a, c - a);
    const double area = glm::dot(n, n);
    w.x = glm::dot(n, glm::cross(c - b, q - b)) / area;
    w.y = glm::dot(n, glm::cross(a - c, q - c)) / area;
    w.z = 1.0 - w.x - w.y;
    if (w.x >= 0 && w.y >= 0 && w.z >= 0) return w.x * a + w.y * b + w.z * c;
    dvec3 best = a;
    for (const auto& [p, e] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)}) {
      const dvec3 on = p + std::clamp(glm::dot(q - p, e - p) / glm::dot(e - p, e - p), 0.0, 1.0) * (e - p);
      if (glm::length(q - on) < glm::length(q - best)) best = on;
    }
    return best;
  };
  constexpr double kStiffness = 20.0;
  std::vector<double> multiplier(mesh.triangles.size(), 0.0);
  Descent result{start};
  for (int outer = 0; outer < 400; ++outer) {
    for (int inner = 0; inner < 60; ++inner) {
      dvec3 gradient = result.point - goal;
      for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const dvec3 away = result.point - closest(result.point, t);
        const double distance = glm::length(away);
        const double push = multiplier[t] + kStiffness * (radius - distance);
        if (push > 0.0) gradient -= push * away / distance;
      }
      result.point -= 0.004 * gradient;
      result.residual = glm::length(gradient);
    }
    result.depth = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const double depth = radius - glm::length(result.point - closest(result.point, t));
      multiplier[t] = std::max(0.0, multiplier[t] + kStiffness * depth);
      result.depth = std::max(result.depth, depth);
    }
  }
  return result;
}

TEST(FirstOrder, WhereASlowDescentEndsInARoughMesh) {
  int ended = 0;
  for (std::uint64_t seed = 1; seed <= 14; ++seed) {
    std::mt19937_64 random(seed);
    // A ball in a bowl of random facets, and one on random bumps.
    TriangleMesh mesh = make_ball_mesh(1.0, 1);
    std::uniform_real_distribution<double> u(0.75, 1.25);
    for (dvec3& v : mesh.vertices) v *= u(random);
    const FirstOrderReference reference(mesh);
    const dvec3 way = random_unit(random);
    const bool in = seed % 2 == 0;
    const double radius = 0.2;
    const dvec3 start = in ? dvec3(0.0) : 1.8 * way;
    const dvec3 goal = in ? 1.3 * way : 0.7 * way;
    const Descent end = descend(mesh, goal, start, radius);
    if (end.depth > 1e-9 || end.residual > 1e-8) continue;  // circling a place that is no minimum
    ++ended;
    const NearestOptimum found = reference.nearest_optimum(goal, end.point, radius, 0.1);
    ASSERT_TRUE(found.found) << seed;
    EXPECT_LT(found.error_m, 1e-6) << seed;
    EXPECT_NEAR(found.clearance_m, mesh_distance(end.point, mesh) - radius, 1e-12);
    for (const double away : {1e-6, 1e-5, 1e-4}) {
      const dvec3 aside = end.point + away * random_unit(random);
      EXPECT_LE(reference.nearest_optimum(goal, aside, radius, 0.1).error_m, away + 1e-6) << seed;
    }
  }
  EXPECT_GE(ended, 10);
}

// Whatever is found is feasible, and no direction that the contacts leave free brings the goal nearer: looked
// for by many small steps.
TEST(FirstOrder, NothingNearbyIsBetterThanWhatIsFound) {
  int found_some = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    std::mt19937_64 random(seed);
    const Terrain terrain(seed);
    const FirstOrderReference reference(terrain.mesh);
    const dvec3 proxy = dvec3(3.5, 3.5, 0.8) + tests::random_point(random, 0.6);
    const dvec3 goal = dvec3(proxy.x, proxy.y, -1.0) + tests::random_point(random, 0.4);
    const double radius = 0.1 + 0.01 * static_cast<double>(seed);
    const NearestOptimum found = reference.nearest_optimum(goal, proxy, radius, 2.0);
    if (!found.found) continue;
    ++found_some;
    ASSERT_GE(mesh_distance(found.point, terrain.mesh), radius - 1e-11);
    const double here = glm::length(found.point - goal);
    constexpr double kStep = 1e-5;
    for (int i = 0; i < 400; ++i) {
      const dvec3 there = found.point + kStep * random_unit(random);
      if (mesh_distance(there, terrain.mesh) < radius) continue;
      // First order: what is gained is of second order in the step, curved surfaces included.
      EXPECT_GT(glm::length(there - goal), here - 20.0 * kStep * kStep / radius * (1.0 + here)) << seed;
    }
  }
  EXPECT_GE(found_some, 30);
}

}  // namespace
