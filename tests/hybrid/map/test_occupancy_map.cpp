// SPDX-License-Identifier: GPL-3.0-or-later
// The occupancy map against brute force over its content. Its resolution is a cell. So a query must report
// everything inside a box, and may also report things within one cell of the box.
#include "hybrid/map/occupancy_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>
#include <limits>
#include <random>
#include <set>
#include <utility>
#include <vector>

namespace {

using glm::dvec3;
using hybrid::OccupancyMap;
using Triangle = std::array<dvec3, 3>;

dvec3 random_point(std::mt19937_64& random, double half) {
  std::uniform_real_distribution<double> u(-half, half);
  const double x = u(random), y = u(random), z = u(random);
  return {x, y, z};
}

bool within(const dvec3& p, const dvec3& low, const dvec3& high) {
  return glm::all(glm::greaterThanEqual(p, low)) && glm::all(glm::lessThanEqual(p, high));
}

// Whether a triangle meets a box. The triangle is clipped by the box's six planes (Sutherland & Hodgman
// 1974).
bool meets(const Triangle& t, const dvec3& low, const dvec3& high) {
  std::vector<dvec3> polygon(t.begin(), t.end());
  for (int d = 0; d < 3; ++d) {
    for (const double side : {1.0, -1.0}) {
      const double bound = side > 0.0 ? low[d] : -high[d];
      std::vector<dvec3> kept;
      for (std::size_t i = 0; i < polygon.size(); ++i) {
        const dvec3 &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
        const double ha = side * a[d] - bound, hb = side * b[d] - bound;
        if (ha >= 0.0) kept.push_back(a);
        if ((ha < 0.0) != (hb < 0.0)) kept.push_back(a + (ha / (ha - hb)) * (b - a));
      }
      polygon = kept;
      if (polygon.empty()) return false;
    }
  }
  return true;
}

// Each test runs at the scene's origin and far from it.
class Occupancy : public ::testing::TestWithParam<double> {
 protected:
  static constexpr double kCell = 2e-3;
  const dvec3 origin{GetParam(), -GetParam(), 0.5 * GetParam()};
  // Rounding of coordinates at this distance from the origin.
  const double rounding = 1e-15 + 4e-16 * GetParam();
  std::mt19937_64 random{99};
  OccupancyMap map{kCell, origin};
  OccupancyMap::Trail trail;  // one trail for all queries

  void expect_soft(const std::vector<dvec3>& points, const dvec3& low, const dvec3& high) {
    std::vector<std::uint32_t> out(points.size());
    const std::size_t count = map.soft_in(low, high, out);
    const std::set<std::uint32_t> found(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(count));
    ASSERT_EQ(found.size(), count) << "a voxel was reported twice";
    std::vector<std::uint32_t> again(points.size());
    ASSERT_EQ(map.soft_in(low, high, again, trail), count);
    ASSERT_EQ(again, out) << "the trail changed the answer";
    const dvec3 cell(kCell + 4.0 * rounding);
    for (std::uint32_t n = 0; n < points.size(); ++n) {
      if (within(points[n], low, high)) {
        ASSERT_TRUE(found.contains(n)) << "voxel " << n << " was missed";
      }
      if (found.contains(n)) {
        ASSERT_TRUE(within(points[n], low - cell, high + cell)) << "voxel " << n << " is elsewhere";
      }
    }
    if (count > 0) {
      ASSERT_TRUE(map.any_near(low, high));
    }
  }
};

TEST_P(Occupancy, FindsSoftVoxelsAsBruteForceDoesAfterManyMoves) {
  std::vector<dvec3> points;
  const std::uint32_t first = map.add_soft(500);
  ASSERT_EQ(first, 0U);
  for (std::uint32_t n = 0; n < 500; ++n) {
    points.push_back(origin + random_point(random, 0.05));
    map.place(n, points.back());
  }
  map.reserve_bricks(4096);
  ASSERT_TRUE(map.validate());
  std::uniform_int_distribution<std::size_t> any(0, points.size() - 1);
  for (int round = 0; round < 60; ++round) {
    for (int n = 0; n < 1000; ++n) {
      const std::size_t i = any(random);
      // Most steps are small, like those of tissue. Some lead across the scene.
      points[i] +=
          n % 10 == 0 ? 0.5 * (origin - points[i]) + random_point(random, 0.04) : random_point(random, 1e-3);
      map.move(static_cast<std::uint32_t>(i), points[i]);
    }
    ASSERT_TRUE(map.validate()) << "after " << (round + 1) * 1000 << " moves";
    for (int n = 0; n < 20; ++n) {
      const dvec3 centre = origin + random_point(random, 0.06), half = glm::abs(random_point(random, 0.02));
      expect_soft(points, centre - half, centre + half);
      if (HasFatalFailure()) return;
    }
  }
  EXPECT_EQ(map.overflows(), 0U);
}

// All 64 cells of a block get two voxels each, more than the block's inline capacity, and become empty again.
TEST_P(Occupancy, ABlockMayBeFullAndEmptyAgain) {
  const dvec3 far = origin + 100.0 * kCell;
  std::vector<dvec3> cells, points;
  for (int n = 0; n < 64; ++n) cells.push_back(origin + kCell * (dvec3(n % 4, n / 4 % 4, n / 16) + 0.5));
  map.add_soft(128);
  for (std::uint32_t n = 0; n < 128; ++n) {
    points.push_back(far);
    map.place(n, far);
  }
  map.reserve_bricks(2);
  for (int round = 0; round < 6; ++round) {
    std::vector<std::uint32_t> order(128);
    for (std::uint32_t n = 0; n < 128; ++n) order[n] = n;
    std::shuffle(order.begin(), order.end(), random);
    for (const std::uint32_t n : order) {
      points[n] = round % 2 == 0 ? cells[n % 64] : far;
      map.move(n, points[n]);
      ASSERT_TRUE(map.validate());
      const dvec3& at = cells[random() % 64];
      expect_soft(points, at, at);
      expect_soft(points, at - kCell, at + kCell);
      if (HasFatalFailure()) return;
    }
    expect_soft(points, origin, origin + 4.0 * kCell);
    ASSERT_EQ(map.overflows(), 0U);
  }
}

TEST_P(Occupancy, FindsRigidSurfacesAsBruteForceDoes) {
  std::vector<Triangle> triangles;
  for (std::uint32_t n = 0; n < 40; ++n) {
    const dvec3 a = origin + random_point(random, 0.05);
    // The triangles are fat triangles, slivers, segments and points. Some lie in the faces between cells.
    Triangle t{a, a + random_point(random, 0.01), a + random_point(random, 0.01)};
    if (n % 5 == 1) t[2] = t[0] + 0.5 * (t[1] - t[0]) + 1e-9;
    if (n % 5 == 2) t[2] = t[1] = t[0];
    if (n % 5 == 3) t[0].z = t[1].z = t[2].z = origin.z + 3 * kCell;
    triangles.push_back(t);
    map.add_triangle(n, t[0], t[1], t[2]);
  }
  for (int n = 0; n < 1500; ++n) {
    const dvec3 centre = origin + random_point(random, 0.06),
                half = glm::abs(random_point(random, n % 2 == 0 ? 2e-3 : 0.02));
    const dvec3 low = centre - half, high = centre + half;
    const std::uint64_t mask = map.rigid_in(low, high);
    ASSERT_EQ(map.rigid_in(low, high, trail), mask) << "the trail changed the answer";
    bool near = false;
    for (std::uint32_t o = 0; o < triangles.size(); ++o) {
      if (meets(triangles[o], low, high)) {
        ASSERT_NE(mask & OccupancyMap::rigid_bit(o), 0U) << "object " << o << " was missed";
      }
      const dvec3 cell(kCell + 1e-9 + 8.0 * rounding);
      near = near || meets(triangles[o], low - cell, high + cell);
    }
    if (!near) {
      ASSERT_EQ(mask, 0U) << "nothing rigid is within a cell of this box";
    }
    if (mask != 0) {
      ASSERT_TRUE(map.any_near(low, high));
    }
  }
}

TEST_P(Occupancy, NothingIsNearWhereNothingIs) {
  map.add_soft(1);
  map.place(0, origin);
  map.add_triangle(0, origin, origin + dvec3(1e-3, 0, 0), origin + dvec3(0, 1e-3, 0));
  // A brick is eight cells wide.
  const double brick = 8.0 * kCell + 4.0 * rounding;
  EXPECT_TRUE(map.any_near(origin - 1e-4, origin + 1e-4));
  EXPECT_FALSE(map.any_near(origin + 2.0 * brick, origin + 3.0 * brick));
  EXPECT_FALSE(map.any_near(origin - 3.0 * brick, origin - 2.0 * brick));
  // A voxel that has left a place is no longer found there.
  map.reserve_bricks(64);
  map.move(0, origin + dvec3(10.0 * brick));
  std::vector<std::uint32_t> out(4);
  EXPECT_EQ(map.soft_in(origin - 1e-3, origin + 1e-3, out), 0U);
  EXPECT_EQ(map.soft_in(origin + 10.0 * brick - 1e-3, origin + 10.0 * brick + 1e-3, out), 1U);
}

// Seven voxels need seven bricks, but there are only four. In the map, a voxel without a brick keeps its last
// position.
TEST_P(Occupancy, AFullMapKeepsAVoxelWhereItWasLastKnown) {
  map.add_soft(7);
  for (std::uint32_t n = 0; n < 7; ++n) map.place(n, origin);
  map.reserve_bricks(3);
  for (std::uint32_t n = 1; n < 7; ++n) map.move(n, origin + dvec3(0.1 * n, 0, 0));
  EXPECT_EQ(map.overflows(), 3U);
  EXPECT_TRUE(map.validate());
  std::vector<std::uint32_t> out(8);
  EXPECT_EQ(map.soft_in(origin - 1e-3, origin + 1e-3, out), 4U);
  // One voxel returns, so its brick becomes free for another voxel.
  map.move(1, origin);
  map.move(6, origin + dvec3(0.6, 0, 0));
  EXPECT_EQ(map.overflows(), 3U);
  EXPECT_EQ(map.soft_in(origin - 1e-3, origin + 1e-3, out), 4U);
  EXPECT_EQ(map.soft_in(origin + dvec3(0.6, 0, 0) - 1e-3, origin + dvec3(0.6, 0, 0) + 1e-3, out), 1U);
  EXPECT_TRUE(map.validate());
}

TEST_P(Occupancy, WritesNoMoreThanThereIsRoomFor) {
  map.add_soft(100);
  for (std::uint32_t n = 0; n < 100; ++n) map.place(n, origin);
  std::vector<std::uint32_t> out(7);
  EXPECT_EQ(map.soft_in(origin - 1e-3, origin + 1e-3, out), 7U);
}

INSTANTIATE_TEST_SUITE_P(AtAndFarFromTheOrigin, Occupancy, ::testing::Values(0.0, 1.0, 1e6));

TEST(OccupancyMap, MemoryFollowsOccupiedCellsAndNotTheExtent) {
  OccupancyMap map(1e-3, dvec3(0.0));
  map.add_soft(2);
  map.place(0, dvec3(-1000.0));
  map.place(1, dvec3(1000.0));
  EXPECT_EQ(map.occupied_cells(), 2U);
  EXPECT_LT(map.memory_bytes(), 100'000U);
}

TEST(OccupancyMap, ManyObjectsShareTheLastBit) {
  OccupancyMap map(1.0, dvec3(0.0));
  for (std::uint32_t o = 0; o < 100; ++o) {
    const dvec3 at(100.0 * o, 0.0, 0.0);
    map.add_triangle(o, at, at + dvec3(0.5, 0, 0), at + dvec3(0, 0.5, 0));
  }
  for (std::uint32_t o = 0; o < 100; ++o) {
    const dvec3 at(100.0 * o, 0.0, 0.0);
    EXPECT_EQ(map.rigid_in(at - 0.1, at + 0.1), 1ULL << std::min(o, 63U));
  }
}

// Tests each axis with coordinates on both sides of a cell's face and of zero, and with coordinates that have
// no cell.
TEST(OccupancyMap, ACellBeginsAtItsLowerFace) {
  const hybrid::BrickGrid grid(0.5, dvec3(0.0));
  const double far = 1e300, none = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::pair<double, std::int32_t>> cells{{0.0, 0},
                                                           {-0.0, 0},
                                                           {0.5, 1},
                                                           {std::nextafter(0.5, 0.0), 0},
                                                           {-5e-324, -1},
                                                           {-0.5, -1},
                                                           {std::nextafter(-0.5, -1.0), -2},
                                                           {1e8 + 0.75, 200'000'001},
                                                           {-1e8 - 0.75, -200'000'002},
                                                           {far, 1'000'000'000},
                                                           {-far, -1'000'000'000},
                                                           {none, 1'000'000'000}};
  for (const auto& [x, cell] : cells) {
    EXPECT_EQ(grid.cell_of({x, 0.25, -0.25}), (hybrid::CellCoordinates{cell, 0, -1})) << x;
    EXPECT_EQ(grid.cell_of({-0.25, x, 0.25}), (hybrid::CellCoordinates{-1, cell, 0})) << x;
    EXPECT_EQ(grid.cell_of({0.25, -0.25, x}), (hybrid::CellCoordinates{0, -1, cell})) << x;
  }
}

// A path leads forward and back through blocks that exist, do not exist, or appear and vanish meanwhile.
// Queries with a trail must give the same answers as without, even if the trail was used in another map.
TEST(OccupancyMap, APathFindsWhatIsThereNow) {
  constexpr double kCell = 1e-3;
  constexpr std::uint32_t kCount = 20'000;
  std::mt19937_64 random(5);
  OccupancyMap map(kCell, dvec3(0.0)), other(kCell, dvec3(0.0));
  map.add_soft(kCount);
  other.add_soft(kCount);
  for (std::uint32_t n = 0; n < kCount; ++n) {
    map.place(n, random_point(random, 0.04));
    other.place(n, random_point(random, 0.04));
  }
  map.reserve_bricks(4096);
  other.reserve_bricks(0);
  OccupancyMap::Trail trail;
  std::array<std::uint32_t, 64> with{}, without{};
  std::uint32_t mover = 0;
  for (int path = 0; path < 200; ++path) {
    const dvec3 start = random_point(random, 0.05), way = random_point(random, 0.4 * kCell);
    for (int n = 0; n < 200; ++n) {
      const dvec3 p = start + static_cast<double>(n < 150 ? n : 300 - n) * way;
      // Some voxel enters or leaves the path.
      map.move(mover++ % kCount, n % 3 == 0 ? p + way : random_point(random, 0.04));
      if (n % 50 == 49) (void)other.soft_in(p, p, with, trail);
      const std::size_t count = map.soft_in(p, p, with, trail);
      ASSERT_EQ(count, map.soft_in(p, p, without));
      ASSERT_TRUE(
          std::equal(with.begin(), with.begin() + static_cast<std::ptrdiff_t>(count), without.begin()));
    }
  }
  EXPECT_TRUE(map.validate());
}

TEST(OccupancyMap, RefusesACellThatIsNone) {
  EXPECT_THROW(OccupancyMap(0.0, dvec3(0.0)), std::invalid_argument);
  EXPECT_THROW(OccupancyMap(-1.0, dvec3(0.0)), std::invalid_argument);
  EXPECT_THROW(OccupancyMap(std::nan(""), dvec3(0.0)), std::invalid_argument);
}

}  // namespace
