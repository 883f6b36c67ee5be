// SPDX-License-Identifier: GPL-3.0-or-later
// Moving bodies in the occupancy map, against brute force over their triangles and against a map that is
// built at their present poses.
#include "hybrid/map/moving_surface_layer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>
#include <glm/vector_relational.hpp>
#include <memory>
#include <random>
#include <vector>

#include "hybrid/map/occupancy_map.h"
#include "polygon/surface/primitives.h"

namespace {

using glm::dquat;
using glm::dvec3;
using hybrid::OccupancyMap;
using hybrid::SurfaceCells;

constexpr double kCell = 2e-3;

dvec3 random_vector(std::mt19937_64& random, double half) {
  std::uniform_real_distribution<double> u(-half, half);
  const double x = u(random), y = u(random), z = u(random);
  return {x, y, z};
}

// Dense random points of the surface, `a_triangle` per triangle. The map must report a box that contains such
// a point.
std::vector<dvec3> points_on(const polygon::TriangleMesh& mesh, std::mt19937_64& random, int a_triangle) {
  std::uniform_real_distribution<double> u(0.0, 1.0);
  std::vector<dvec3> points;
  for (const auto& t : mesh.triangles) {
    for (int n = 0; n < a_triangle; ++n) {
      double s = u(random), r = u(random);
      if (s + r > 1.0) {
        s = 1.0 - s;
        r = 1.0 - r;
      }
      const dvec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
      points.push_back(a + s * (b - a) + r * (c - a));
    }
  }
  return points;
}

struct Body {
  polygon::TriangleMesh mesh;
  std::vector<dvec3> points;  // body frame
  dvec3 position{0.0};
  dquat rotation{1.0, 0.0, 0.0, 0.0};
  dvec3 velocity{0.0}, spin{0.0};

  [[nodiscard]] dvec3 to_scene(const dvec3& p) const { return position + rotation * p; }
  // Least distance of the body's points from a box (m).
  [[nodiscard]] double distance_to_box(const dvec3& low, const dvec3& high) const {
    double least = 1e300;
    for (const dvec3& p : points) {
      const dvec3 at = to_scene(p);
      least = std::min(least, glm::distance(at, glm::clamp(at, low, high)));
    }
    return least;
  }
};

std::shared_ptr<const SurfaceCells> cells_of(const polygon::TriangleMesh& mesh, double cell = kCell) {
  auto cells = std::make_shared<SurfaceCells>(cell, dvec3(0.0));
  for (const auto& t : mesh.triangles)
    cells->add_triangle(1, mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
  cells->seal();
  return cells;
}

std::vector<Body> some_bodies(std::mt19937_64& random, const dvec3& origin, std::size_t count) {
  std::vector<Body> bodies(count);
  for (std::size_t b = 0; b < count; ++b) {
    Body& body = bodies[b];
    const double size = 0.004 * std::pow(1.6, static_cast<double>(b % 5));
    body.mesh = b % 3 == 0   ? polygon::make_box_mesh({size, 0.5 * size, 1.5 * size}, 3)
                : b % 3 == 1 ? polygon::make_ball_mesh(size, 2)
                             : polygon::make_plane_mesh(size, 4);
    body.points = points_on(body.mesh, random, 8);
    body.position = origin + random_vector(random, 0.05);
    body.rotation = glm::normalize(dquat(1.0, random_vector(random, 2.0)));
  }
  return bodies;
}

class MovingBodies : public ::testing::TestWithParam<std::tuple<double, std::size_t>> {
 protected:
  const dvec3 origin{std::get<0>(GetParam()), -std::get<0>(GetParam()), 0.5 * std::get<0>(GetParam())};
  std::mt19937_64 random{2024};
  std::vector<Body> bodies = some_bodies(random, origin, std::get<1>(GetParam()));
  std::vector<std::shared_ptr<const SurfaceCells>> cells;
  OccupancyMap map{kCell, origin};

  void SetUp() override {
    for (std::uint32_t b = 0; b < bodies.size(); ++b) {
      cells.push_back(cells_of(bodies[b].mesh));
      map.add_moving(b, cells[b], bodies[b].position, bodies[b].rotation);
    }
    map.reserve_bricks(0);
  }
  void move_all(int round, double dt) {
    for (std::uint32_t b = 0; b < bodies.size(); ++b) {
      Body& body = bodies[b];
      if (round % 50 == 0) {
        // Speeds range from nearly 0 to 10 m/s and 3,000 rad/s, with occasional jumps.
        const double speed = std::pow(10.0, -4.0 + 5.0 * static_cast<double>(random() % 100) / 99.0);
        body.velocity = speed * random_vector(random, 1.0);
        body.spin = 300.0 * speed * random_vector(random, 1.0);
        if (random() % 4 == 0) body.position = origin + random_vector(random, 0.08);
      }
      body.position += dt * body.velocity;
      for (int d = 0; d < 3; ++d) {
        if (std::fabs(body.position[d] - origin[d]) > 0.08) body.velocity[d] = -body.velocity[d];
      }
      const double turn = dt * glm::length(body.spin);
      if (turn > 0.0)
        body.rotation = glm::normalize(glm::angleAxis(turn, glm::normalize(body.spin)) * body.rotation);
      map.move_body(b, body.position, body.rotation);
    }
  }
};

TEST_P(MovingBodies, AreNeverMissedAndFoundOnlyWhereTheyAre) {
  const int rounds = 10'000;
  std::size_t hits = 0, misses = 0;
  for (int round = 0; round < rounds; ++round) {
    move_all(round, 1e-3);
    // The box lies near a point of some body, or anywhere.
    const Body& some = bodies[random() % bodies.size()];
    const bool aimed = random() % 2 == 0;
    const dvec3 centre =
        aimed ? some.to_scene(some.points[random() % some.points.size()]) + random_vector(random, 4e-3)
              : origin + random_vector(random, 0.09);
    const dvec3 half = glm::abs(random_vector(random, round % 20 == 0 ? 0.06 : 3e-3));
    const dvec3 low = centre - half, high = centre + half;
    const std::uint64_t mask = map.rigid_in(low, high);
    for (std::uint32_t b = 0; b < bodies.size(); ++b) {
      // Most bodies are far away, and must not be reported.
      if (glm::distance(bodies[b].position, centre) > 0.06 + glm::length(half)) {
        ASSERT_EQ(mask & OccupancyMap::rigid_bit(b), 0U) << "body " << b << " is far away";
        continue;
      }
      const double distance = bodies[b].distance_to_box(low, high);
      const bool said = (mask & OccupancyMap::rigid_bit(b)) != 0;
      if (distance <= 0.0) {
        ASSERT_TRUE(said) << "body " << b << " was missed in round " << round;
        ++hits;
      }
      // A reported body must be near the box. The query uses the box's bounds in the body's frame. They
      // exceed the box by at most (√3 − 1) of its half diagonal, and cells add to this.
      if (said) {
        ASSERT_LE(distance, 0.74 * glm::length(half) + 2.0 * kCell + 2e-3) << "body " << b << " is elsewhere";
      } else {
        ++misses;
      }
    }
    if (mask != 0) {
      ASSERT_TRUE(map.any_near(low, high));
    }
    if (round % 100 == 0) {
      ASSERT_TRUE(map.validate());
    }
  }
  EXPECT_GT(hits, 500U);
  EXPECT_GT(misses, 500U);
}

TEST_P(MovingBodies, AnswerAsAMapThatIsBuiltWhereTheyAre) {
  for (int round = 0; round < 200; ++round) {
    for (int n = 0; n < 20; ++n) move_all(round * 20 + n, 1e-3);
    OccupancyMap fresh(kCell, origin);
    for (std::uint32_t b = 0; b < bodies.size(); ++b)
      fresh.add_moving(b, cells[b], bodies[b].position, bodies[b].rotation);
    for (int n = 0; n < 50; ++n) {
      const Body& some = bodies[random() % bodies.size()];
      const dvec3 centre =
          some.to_scene(some.points[random() % some.points.size()]) + random_vector(random, 8e-3);
      const dvec3 half = glm::abs(random_vector(random, n % 5 == 0 ? 0.05 : 2e-3));
      ASSERT_EQ(map.rigid_in(centre - half, centre + half), fresh.rigid_in(centre - half, centre + half));
      ASSERT_EQ(map.any_near(centre - half, centre + half), fresh.any_near(centre - half, centre + half));
    }
  }
}

TEST_P(MovingBodies, TakeNoMoreMemoryForHavingMoved) {
  const std::size_t bytes = map.memory_bytes();
  for (int round = 0; round < 5000; ++round) move_all(round, 1e-2);
  EXPECT_EQ(map.memory_bytes(), bytes);
}

INSTANTIATE_TEST_SUITE_P(FewAndMany, MovingBodies,
                         ::testing::Combine(::testing::Values(0.0, 1e6), ::testing::Values(1U, 4U, 40U)));

// Moving bodies share a map with fixed surfaces and soft voxels. Each query reports only its own kinds of
// object.
TEST(MovingSurfaceLayer, ShareTheMapWithWhatStays) {
  OccupancyMap map(kCell, dvec3(0.0));
  map.add_triangle(0, dvec3(0.0), dvec3(0.01, 0, 0), dvec3(0, 0.01, 0));
  map.add_soft(1);
  map.place(0, dvec3(0.0));
  map.add_moving(1, cells_of(polygon::make_ball_mesh(0.01, 2)), dvec3(0.5), dquat(1, 0, 0, 0));
  map.reserve_bricks(4);
  const dvec3 box(0.001);
  EXPECT_EQ(map.rigid_in(-box, box), 1U);
  EXPECT_EQ(map.rigid_in(dvec3(0.49) - 0.02, dvec3(0.49) + 0.02), 2U);
  map.move_body(1, dvec3(0.0, 0.0, 0.01), dquat(1, 0, 0, 0));
  EXPECT_EQ(map.rigid_in(-box, box), 3U);
  EXPECT_FALSE(map.any_near(dvec3(0.49) - 0.02, dvec3(0.49) + 0.02));
  std::vector<std::uint32_t> out(8);
  EXPECT_EQ(map.soft_in(-box, box, out), 1U) << "bodies are no voxels";
  map.move_body(0, dvec3(9.0), dquat(1, 0, 0, 0));  // object 0 does not move
  map.move_body(7, dvec3(9.0), dquat(1, 0, 0, 0));  // there is no object 7
  map.move_body(1, dvec3(std::nan("")), dquat(1, 0, 0, 0));
  EXPECT_EQ(map.rigid_in(-box, box), 3U);
  EXPECT_TRUE(map.validate());
}

TEST(MovingSurfaceLayer, OnlyDistrictsThatABodyLeavesOrEntersChange) {
  OccupancyMap map(kCell, dvec3(0.0));
  const double radius = 0.05;
  for (std::uint32_t b = 0; b < 20; ++b)
    map.add_moving(b, cells_of(polygon::make_ball_mesh(radius, 2)), dvec3(0.3 * b, 0.0, 0.0),
                   dquat(1, 0, 0, 0));
  map.reserve_bricks(0);
  ASSERT_EQ(map.district_changes(), 0U);
  // Rotation in place does not change districts.
  for (int n = 0; n < 1000; ++n) map.move_body(3, {0.9, 0.0, 0.0}, glm::angleAxis(0.01 * n, dvec3(0, 0, 1)));
  EXPECT_EQ(map.district_changes(), 0U);
  // The body moves by its own length in 10,000 steps. Its front and its back each cross at most one border
  // along x, with at most four districts each.
  for (int n = 0; n <= 10'000; ++n)
    map.move_body(3, {0.9 + 2.0 * radius * n / 10'000.0, 0.0, 0.0}, dquat(1, 0, 0, 0));
  EXPECT_LE(map.district_changes(), 16U);
  EXPECT_GE(map.district_changes(), 1U);
  EXPECT_TRUE(map.validate());
}

// Points of the exact ball lie outside its inscribed triangles. With the margin of a curved surface, they
// must be found.
TEST(SurfaceCells, AMarginCoversWhatTheTrianglesStandFor) {
  std::mt19937_64 random(3);
  const double radius = 0.05;
  const polygon::TriangleMesh mesh = polygon::make_ball_mesh(radius, 3);
  double deepest = 0.0;
  for (const auto& t : mesh.triangles) {
    deepest = std::max(
        deepest,
        radius - glm::length((mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]) / 3.0));
  }
  SurfaceCells cells(0.5e-3, dvec3(0.0));
  for (const auto& t : mesh.triangles)
    cells.add_triangle(1, mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]], 1.05 * deepest);
  cells.seal();
  for (int n = 0; n < 20'000; ++n) {
    const dvec3 p = radius * glm::normalize(random_vector(random, 1.0));
    ASSERT_EQ(cells.objects_in(p, p), 1U);
    ASSERT_TRUE(cells.any_near(p, p));
  }
}

// seal() changes no answer in any part of the bitmap.
TEST(SurfaceCells, SealingChangesNoAnswer) {
  std::mt19937_64 random(5);
  for (const double extent : {0.02, 0.5, 30.0}) {
    SurfaceCells open(kCell, dvec3(0.1)), sealed(kCell, dvec3(0.1));
    for (int n = 0; n < 200; ++n) {
      const dvec3 a = random_vector(random, extent), b = a + random_vector(random, 0.01),
                  c = a + random_vector(random, 0.01);
      open.add_triangle(1ULL << (n % 5), a, b, c);
      sealed.add_triangle(1ULL << (n % 5), a, b, c);
    }
    sealed.seal();
    for (int n = 0; n < 20'000; ++n) {
      const dvec3 centre = random_vector(random, 1.2 * extent),
                  half = glm::abs(random_vector(random, n % 3 == 0 ? extent : 0.01));
      ASSERT_EQ(open.any_near(centre - half, centre + half), sealed.any_near(centre - half, centre + half));
      ASSERT_EQ(open.objects_in(centre - half, centre + half),
                sealed.objects_in(centre - half, centre + half));
    }
    EXPECT_EQ(open.occupied_cells(), sealed.occupied_cells());
  }
}

}  // namespace
