// SPDX-License-Identifier: GPL-3.0-or-later
// The reference on rough surfaces, against optima found by other methods: local minima over a terrain, an
// augmented Lagrangian, and random small steps.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <random>
#include <utility>
#include <vector>

#include "polygon/reference/optimality.h"
#include "polygon/surface/primitives.h"
#include "tests/polygon/fixtures/brute_force.h"

namespace {

using namespace polygon;
using glm::dvec3;

// A terrain with a goal below it. The optima of a point proxy are the local minima of the distance over the
// surface: on a face straight above the goal, in a valley or in a pit. They are found by slopes along the
// surface, without a skin.
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

  // Local minima q of |q − goal| over the surface, away from its rim.
  [[nodiscard]] std::vector<dvec3> minima(const dvec3& goal) const {
    std::vector<dvec3> found;
    const auto consider = [&](const dvec3& q) {
      if (q.x < 1.2 || q.y < 1.2 || q.x > kSide - 2.2 || q.y > kSide - 2.2) return;
      for (const dvec3& other : found) {
        if (glm::length(other - q) < 1e-9) return;
      }
      const double here = glm::length(q - goal);
      // The distance is convex over each triangle. So q is a minimum over a triangle if no point of the
      // triangle is nearer to the goal.
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

TEST(Optimality, PointsInTheValleysAndPitsOfATerrain) {
  int pits = 0, total = 0;
  for (std::uint64_t seed = 1; seed <= 25; ++seed) {
    const Terrain terrain(seed);
    const OptimalityReference reference(terrain.mesh);
    std::mt19937_64 random(seed);
    for (int i = 0; i < 8; ++i) {
      const dvec3 goal = dvec3(3.5, 3.5, -1.5) + tests::random_point(random, 0.7);
      for (const dvec3& optimum : terrain.minima(goal)) {
        ++total;
        for (const dvec3& v : terrain.mesh.vertices) pits += v == optimum ? 1 : 0;
        // A direction out of the surface that rises from all adjacent faces.
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

// Augmented Lagrangian (Nocedal & Wright, Numerical Optimization, 17.3) with plain gradient steps. It is
// slow, and it uses only the distances of triangles.
struct Descent {
  dvec3 point{0.0};
  double residual = 0.0;  // largest residual of the balance of forces
  double depth = 0.0;     // largest penetration
};

Descent descend(const TriangleMesh& mesh, const dvec3& goal, const dvec3& start, double radius) {
  const auto closest = [&](const dvec3& q, std::size_t t) {
    // Computes the closest point by projection, because central differences of the distance would be
    // inaccurate.
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

TEST(Optimality, WhereASlowDescentEndsInARoughMesh) {
  int ended = 0;
  for (std::uint64_t seed = 1; seed <= 14; ++seed) {
    std::mt19937_64 random(seed);
    // A ball inside a bowl of random facets, or on random bumps.
    TriangleMesh mesh = make_ball_mesh(1.0, 1);
    std::uniform_real_distribution<double> u(0.75, 1.25);
    for (dvec3& v : mesh.vertices) v *= u(random);
    const OptimalityReference reference(mesh);
    const dvec3 way = tests::random_unit(random);
    const bool in = seed % 2 == 0;
    const double radius = 0.2;
    const dvec3 start = in ? dvec3(0.0) : 1.8 * way;
    const dvec3 goal = in ? 1.3 * way : 0.7 * way;
    const Descent end = descend(mesh, goal, start, radius);
    if (end.depth > 1e-9 || end.residual > 1e-8) continue;  // did not converge to a minimum
    ++ended;
    const NearestOptimum found = reference.nearest_optimum(goal, end.point, radius, 0.1);
    ASSERT_TRUE(found.found) << seed;
    EXPECT_LT(found.error_m, 1e-6) << seed;
    EXPECT_NEAR(found.clearance_m, tests::mesh_distance(end.point, mesh) - radius, 1e-12);
    for (const double away : {1e-6, 1e-5, 1e-4}) {
      const dvec3 aside = end.point + away * tests::random_unit(random);
      EXPECT_LE(reference.nearest_optimum(goal, aside, radius, 0.1).error_m, away + 1e-6) << seed;
    }
  }
  EXPECT_GE(ended, 10);
}

// Each result is feasible, and many random small steps that stay feasible do not come nearer to the goal.
TEST(Optimality, NothingNearbyIsBetterThanWhatIsFound) {
  int found_some = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    std::mt19937_64 random(seed);
    const Terrain terrain(seed);
    const OptimalityReference reference(terrain.mesh);
    const dvec3 proxy = dvec3(3.5, 3.5, 0.8) + tests::random_point(random, 0.6);
    const dvec3 goal = dvec3(proxy.x, proxy.y, -1.0) + tests::random_point(random, 0.4);
    const double radius = 0.1 + 0.01 * static_cast<double>(seed);
    const NearestOptimum found = reference.nearest_optimum(goal, proxy, radius, 2.0);
    if (!found.found) continue;
    ++found_some;
    ASSERT_GE(tests::mesh_distance(found.point, terrain.mesh), radius - 1e-11);
    const double here = glm::length(found.point - goal);
    constexpr double kStep = 1e-5;
    for (int i = 0; i < 400; ++i) {
      const dvec3 there = found.point + kStep * tests::random_unit(random);
      if (tests::mesh_distance(there, terrain.mesh) < radius) continue;
      // At an optimum a feasible step gains at most a second-order amount, also on curved surfaces.
      EXPECT_GT(glm::length(there - goal), here - 20.0 * kStep * kStep / radius * (1.0 + here)) << seed;
    }
  }
  EXPECT_GE(found_some, 30);
}

}  // namespace
