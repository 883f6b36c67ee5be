// SPDX-License-Identifier: GPL-3.0-or-later
// After any number of motions, the map equals a map that is built from the present positions. Voxels that
// move far and for a long time need no more memory.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
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

std::vector<std::uint32_t> soft_in(const OccupancyMap& map, const dvec3& low, const dvec3& high,
                                   std::size_t most) {
  std::vector<std::uint32_t> out(most + 1);
  out.resize(map.soft_in(low, high, out));
  std::sort(out.begin(), out.end());  // because the map's lists are in the order of motion
  return out;
}

// Soft voxels at rest in sheets, fixed triangles, and moving bodies.
struct Scene {
  dvec3 origin;
  std::vector<dvec3> rest, voxels;
  std::vector<std::shared_ptr<const SurfaceCells>> bodies;
  std::vector<dvec3> position;
  std::vector<dquat> rotation;

  explicit Scene(const dvec3& at) : origin(at) {
    for (int n = 0; n < 3000; ++n)
      rest.push_back(origin + kCell * dvec3(n % 50 - 25, n / 50 % 30 - 15, 9.0 * (n / 1500)));
    voxels = rest;
    for (const double size : {0.01, 0.02, 0.035, 0.005, 0.012, 0.03}) {
      auto cells = std::make_shared<SurfaceCells>(kCell, dvec3(0.0));
      const polygon::TriangleMesh mesh = polygon::make_ball_mesh(size, 2);
      for (const auto& t : mesh.triangles)
        cells->add_triangle(1, mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
      cells->seal();
      bodies.push_back(cells);
      position.push_back(origin);
      rotation.emplace_back(1.0, 0.0, 0.0, 0.0);
    }
  }
  [[nodiscard]] OccupancyMap built() const {
    OccupancyMap map(kCell, origin);
    map.add_triangle(60, origin, origin + dvec3(0.1, 0.02, 0), origin + dvec3(0.01, 0.1, 0.03));
    for (std::uint32_t b = 0; b < bodies.size(); ++b) map.add_moving(b, bodies[b], position[b], rotation[b]);
    map.add_soft(static_cast<std::uint32_t>(voxels.size()));
    for (std::uint32_t n = 0; n < voxels.size(); ++n) map.place(n, voxels[n]);
    map.reserve_bricks(2048);
    return map;
  }
};

class OccupancyExact : public ::testing::TestWithParam<double> {};

TEST_P(OccupancyExact, IsTheMapBuiltFromScratchAfterAHundredThousandMotions) {
  std::mt19937_64 random(7);
  Scene scene({GetParam(), -GetParam(), 0.5 * GetParam()});
  const dvec3 origin = scene.origin;
  OccupancyMap map = scene.built();
  const std::size_t bytes = map.memory_bytes();
  std::size_t crowded = 0;
  for (int n = 1; n <= 100'000; ++n) {
    if (n % 10 == 0) {  // moves a body by a step or a jump
      const std::size_t b = random() % scene.bodies.size();
      scene.position[b] = n % 500 == 0 ? origin + random_vector(random, 0.2)
                                       : scene.position[b] + random_vector(random, 2e-3);
      scene.rotation[b] = glm::normalize(scene.rotation[b] * dquat(1.0, random_vector(random, 0.1)));
      map.move_body(static_cast<std::uint32_t>(b), scene.position[b], scene.rotation[b]);
    } else {
      const std::size_t v = random() % scene.voxels.size();
      dvec3& at = scene.voxels[v];
      switch (random() % 8) {
        case 0:  // back to the rest position
          at = scene.rest[v];
          break;
        case 1:  // into another voxel's cell
          at = scene.voxels[random() % scene.voxels.size()] + random_vector(random, 1e-4);
          break;
        case 2:  // far away
          at = origin + random_vector(random, 0.15);
          break;
        default:
          at += random_vector(random, 3e-3);
      }
      map.move(static_cast<std::uint32_t>(v), at);
    }
    if (n % 20'000 != 0) continue;

    SCOPED_TRACE(n);
    ASSERT_TRUE(map.validate());
    ASSERT_EQ(map.overflows(), 0U);
    const OccupancyMap fresh = scene.built();
    ASSERT_EQ(map.soft_bricks(), fresh.soft_bricks());
    ASSERT_EQ(map.occupied_cells(), fresh.occupied_cells());
    // Queries at every voxel reach every occupied cell.
    for (std::uint32_t v = 0; v < scene.voxels.size(); ++v) {
      const dvec3& at = scene.voxels[v];
      const auto here = soft_in(map, at, at, scene.voxels.size());
      ASSERT_EQ(here, soft_in(fresh, at, at, scene.voxels.size()));
      ASSERT_TRUE(std::binary_search(here.begin(), here.end(), v)) << "voxel " << v << " was missed";
      crowded += here.size() > 1 ? 1 : 0;
    }
    for (int question = 0; question < 5000; ++question) {
      const dvec3 centre = origin + random_vector(random, 0.2),
                  half = glm::abs(random_vector(random, question % 10 == 0 ? 0.1 : 6e-3));
      const dvec3 low = centre - half, high = centre + half;
      ASSERT_EQ(soft_in(map, low, high, scene.voxels.size()), soft_in(fresh, low, high, scene.voxels.size()));
      ASSERT_EQ(map.rigid_in(low, high), fresh.rigid_in(low, high));
      if (fresh.any_near(low, high)) {
        ASSERT_TRUE(map.any_near(low, high));
      }
    }
  }
  EXPECT_GT(crowded, 100U);
  EXPECT_EQ(map.memory_bytes(), bytes);
}

INSTANTIATE_TEST_SUITE_P(AtAndFarFromTheOrigin, OccupancyExact, ::testing::Values(0.0, 1e4));

// 200 voxels wander in a region of a million bricks. The map has capacity for only 200 more bricks than at
// the start.
TEST(OccupancyRoom, VoxelsThatWanderForEverGiveTheirBricksBack) {
  std::mt19937_64 random(8);
  OccupancyMap map(kCell, dvec3(0.0));
  std::vector<dvec3> at(200, dvec3(0.0));
  map.add_soft(200);
  for (std::uint32_t n = 0; n < 200; ++n) {
    at[n] = random_vector(random, 0.02);
    map.place(n, at[n]);
  }
  map.reserve_bricks(200);
  const std::size_t bytes = map.memory_bytes();
  for (int n = 0; n < 1'000'000; ++n) {
    const std::size_t v = random() % at.size();
    at[v] = n % 3 == 0 ? random_vector(random, 0.8) : at[v] + random_vector(random, 0.02);
    map.move(static_cast<std::uint32_t>(v), at[v]);
    if (n % 50'000 == 0) {
      ASSERT_TRUE(map.validate());
    }
    ASSERT_LE(map.soft_bricks(), at.size());
  }
  EXPECT_EQ(map.overflows(), 0U);
  EXPECT_EQ(map.memory_bytes(), bytes);
  for (std::uint32_t v = 0; v < at.size(); ++v) {
    const auto here = soft_in(map, at[v], at[v], at.size());
    EXPECT_TRUE(std::binary_search(here.begin(), here.end(), v));
  }
}

// The map has no spare brick. A voxel that is alone in its brick can still move, because its brick is reused.
TEST(OccupancyRoom, AVoxelThatIsAloneNeedsNoRoomToSpare) {
  OccupancyMap map(kCell, dvec3(0.0));
  map.add_soft(1);
  map.place(0, dvec3(0.0));
  map.reserve_bricks(0);
  for (int n = 1; n <= 1000; ++n) map.move(0, dvec3(0.1 * n, 0, 0));
  EXPECT_EQ(map.overflows(), 0U);
  EXPECT_EQ(soft_in(map, dvec3(100.0, 0, 0), dvec3(100.0, 0, 0), 4).size(), 1U);
  EXPECT_FALSE(map.any_near(dvec3(0.0), dvec3(0.0)));
}

// The bitmap's units that a voxel has left must be empty again.
TEST(OccupancyRoom, NothingIsNearWhereAVoxelHasPassed) {
  for (const double extent :
       {0.4, 1.5, 3.0}) {  // at these extents, a unit has one, two and four bricks along an edge
    SCOPED_TRACE(extent);
    OccupancyMap map(kCell, dvec3(0.0));
    map.add_soft(3);
    map.place(0, dvec3(0.0));
    map.place(1, dvec3(extent));
    map.place(2, 0.5 * dvec3(extent));
    map.reserve_bricks(4);
    for (int n = 0; n <= 100; ++n) map.move(2, (0.1 + 0.008 * n) * dvec3(extent, 0.3 * extent, extent));
    for (int n = 0; n < 90; ++n) {
      const dvec3 p = (0.1 + 0.008 * n) * dvec3(extent, 0.3 * extent, extent);
      EXPECT_FALSE(map.any_near(p - 1e-4, p + 1e-4)) << n;
    }
    EXPECT_TRUE(map.validate());
  }
}

}  // namespace
