// SPDX-License-Identifier: GPL-3.0-or-later
// Polygons of every shape are covered exactly by triangles. So the triangles' areas add up to the area of the
// polygon, and all triangles have its direction.
#include "polygon/repair/cut_polygon.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <random>
#include <vector>

namespace {

using namespace polygon;

using Ring = std::vector<glm::dvec3>;

constexpr double kPi = std::numbers::pi;

Ring flat(const std::vector<std::array<double, 2>>& corners) {
  Ring ring;
  for (const auto& [x, y] : corners) ring.emplace_back(x, y, 0.0);
  return ring;
}

const Ring& notched() {
  static const Ring ring = flat({{0, 0}, {40, 0}, {40, 10}, {10, 10}, {10, 40}, {0, 40}});
  return ring;
}

// Teeth of width 1 and height 5, with gaps of width 1 between them, on a bar of height 1.
Ring comb(int teeth) {
  Ring ring{{0.0, -1.0, 0.0}, {2.0 * teeth - 1.0, -1.0, 0.0}};
  for (int i = teeth; i-- > 0;) {
    const double left = 2.0 * i;
    ring.emplace_back(left + 1.0, 5.0, 0.0);
    ring.emplace_back(left, 5.0, 0.0);
    if (i == 0) break;
    ring.emplace_back(left, 0.0, 0.0);
    ring.emplace_back(left - 1.0, 0.0, 0.0);
  }
  return ring;
}

Ring spiral(int corners) {
  Ring ring;
  for (const bool back : {false, true}) {
    for (int i = 0; i < corners; ++i) {
      const double turn = 6.0 * kPi * (back ? corners - 1 - i : i) / corners;
      const double r = 1.0 + turn + (back ? 1.0 : 0.0);
      ring.emplace_back(r * std::cos(turn), r * std::sin(turn), 0.0);
    }
  }
  std::reverse(ring.begin(), ring.end());
  return ring;
}

// A square with a square hole. A cut connects the hole to the outline, and the polygon runs along it twice.
Ring keyhole() {
  return flat({{0, 0}, {6, 0}, {6, 6}, {0, 6}, {0, 0}, {2, 2}, {2, 4}, {4, 4}, {4, 2}, {2, 2}});
}

glm::dvec3 newell(const Ring& ring) {
  glm::dvec3 sum(0.0);
  for (std::size_t i = 0; i < ring.size(); ++i)
    sum += glm::cross(ring[i] - ring[0], ring[(i + 1) % ring.size()] - ring[0]);
  return 0.5 * sum;
}

struct Covered {
  PolygonCut cut;
  std::size_t triangles = 0;
  double area = 0.0;     // sum over the triangles, along the polygon's normal
  double least = 1e300;  // least area of a triangle
};

Covered cover(const Ring& ring) {
  std::vector<std::uint32_t> corners(ring.size());
  for (std::uint32_t i = 0; i < corners.size(); ++i) corners[i] = i;
  std::vector<TriangleIndices> triangles;
  Covered covered{.cut = cut_polygon(ring, corners, triangles)};
  const glm::dvec3 normal = newell(ring) / std::max(glm::length(newell(ring)), 1e-300);
  covered.triangles = triangles.size();
  for (const auto& [a, b, c] : triangles) {
    const double area = 0.5 * glm::dot(normal, glm::cross(ring[b] - ring[a], ring[c] - ring[a]));
    covered.area += area;
    covered.least = std::min(covered.least, area);
  }
  return covered;
}

void expect_covered(const Ring& ring, const char* what) {
  const Covered covered = cover(ring);
  const double area = glm::length(newell(ring));
  EXPECT_EQ(covered.cut, PolygonCut::inside) << what;
  EXPECT_NEAR(covered.area, area, 1e-12 * area) << what;
  EXPECT_GT(covered.least, 0.0) << what;
  EXPECT_EQ(covered.triangles, ring.size() - 2) << what;
}

// The ring turned and moved at random, with a random first corner and direction. Corners lie up to
// `off_plane` off the plane.
Ring placed(const Ring& ring, std::mt19937_64& random, double off_plane = 0.0) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  glm::dvec3 u = glm::normalize(glm::dvec3(unit(random), unit(random), unit(random)));
  const glm::dvec3 n = glm::normalize(glm::cross(u, glm::dvec3(unit(random), unit(random), unit(random))));
  const glm::dvec3 v = glm::cross(n, u), at(unit(random), unit(random), unit(random));
  Ring result;
  for (const glm::dvec3& p : ring) result.push_back(at + p.x * u + p.y * v + off_plane * unit(random) * n);
  std::rotate(result.begin(), result.begin() + static_cast<std::ptrdiff_t>(random() % result.size()),
              result.end());
  if (random() % 2 == 0) std::reverse(result.begin(), result.end());
  return result;
}

TEST(CutPolygon, ANotchStaysEmptyFromEveryFirstCorner) {
  Ring ring = notched();
  for (std::size_t first = 0; first < ring.size(); ++first) {
    std::rotate(ring.begin(), ring.begin() + 1, ring.end());
    for (int axis = 0; axis < 3; ++axis) {
      for (glm::dvec3& p : ring) p = {p.y, p.z, p.x};
      expect_covered(ring, "turned");
      EXPECT_NEAR(cover(ring).area, 700.0, 1e-9);
      Ring back = ring;
      std::reverse(back.begin(), back.end());
      expect_covered(back, "backwards");
    }
  }
}

TEST(CutPolygon, CombsSpiralsAndStarsAreCoveredInAnyPlane) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> radius(0.1, 2.0);
  for (int i = 0; i < 200; ++i) {
    Ring star;
    for (int k = 0; k < 5 + i % 20; ++k) {
      const double angle = 2.0 * kPi * k / (5 + i % 20), r = radius(random);
      star.emplace_back(r * std::cos(angle), r * std::sin(angle), 0.0);
    }
    expect_covered(placed(star, random), "star");
    expect_covered(placed(notched(), random), "notch");
    expect_covered(placed(comb(1 + i % 9), random), "comb");
    expect_covered(placed(spiral(40), random), "spiral");
  }
  expect_covered(placed(spiral(20'000), random), "a long spiral");
}

// Coordinates are rounded in files, and faces may be a little bent.
TEST(CutPolygon, NearlyPlanarOnesAreCoveredToo) {
  std::mt19937_64 random(4);
  for (const double off : {1e-12, 1e-6, 1e-3, 0.1}) {
    for (int i = 0; i < 50; ++i) {
      const Ring ring = placed(comb(5), random, off);
      const Covered covered = cover(ring);
      EXPECT_EQ(covered.cut, PolygonCut::inside) << off;
      EXPECT_NEAR(covered.area, glm::length(newell(ring)), 1e-9) << off;
      EXPECT_GT(covered.least, 0.0) << off;
    }
  }
}

TEST(CutPolygon, CornersOnAnEdgeMakeNoTriangleWithoutArea) {
  expect_covered(flat({{0, 0}, {1, 0}, {2, 0}, {3, 0}, {3, 3}, {0, 3}, {0, 2}, {0, 1}}), "a square");
  expect_covered(flat({{0, 0}, {20, 0}, {40, 0}, {40, 10}, {20, 10}, {10, 10}, {10, 40}, {0, 40}}),
                 "a notch");
}

TEST(CutPolygon, AHoleAtTheEndOfACutStaysEmpty) {
  std::mt19937_64 random(5);
  for (int i = 0; i < 20; ++i) {
    const Ring ring = i == 0 ? keyhole() : placed(keyhole(), random);
    const Covered covered = cover(ring);
    EXPECT_EQ(covered.cut, PolygonCut::inside);
    EXPECT_NEAR(covered.area, 32.0, 1e-9);
    EXPECT_GT(covered.least, 0.0);
  }
}

TEST(CutPolygon, PartsThatTouchInACornerAreCoveredBoth) {
  const Covered covered = cover(flat({{0, 0}, {2, 1}, {4, 0}, {4, 4}, {2, 1}, {0, 2}}));
  EXPECT_EQ(covered.cut, PolygonCut::inside);
  EXPECT_NEAR(covered.area, 6.0, 1e-12);
  EXPECT_EQ(covered.triangles, 2U);
}

TEST(CutPolygon, WhatCrossesItselfIsSaid) {
  std::mt19937_64 random(6);
  Ring pentagram;
  for (int k = 0; k < 5; ++k) pentagram.emplace_back(std::cos(0.8 * kPi * k), std::sin(0.8 * kPi * k), 0.0);
  for (const Ring& ring : {flat({{0, 0}, {4, 4}, {4, 0}, {0, 4}}), flat({{0, 0}, {5, 4}, {4, 0}, {0, 3}}),
                           pentagram, flat({{0, 0}, {2, 1}, {4, 4}, {4, 0}, {2, 1}, {0, 2}}),
                           flat({{0, 0}, {4, 0}, {4, 4}, {0, 4}, {0, 0}, {4, 0}, {4, 4}, {0, 4}})}) {
    const Covered covered = cover(placed(ring, random));
    EXPECT_EQ(covered.cut, PolygonCut::crossing);
    EXPECT_GT(covered.triangles, 0U) << "it can be touched all the same";
  }
}

// Random corners on a small grid repeat, lie on edges, and run back along edges.
TEST(CutPolygon, OfAnyRingWhatIsCalledInsideCoversItsArea) {
  std::mt19937_64 random(7);
  std::array<std::size_t, 4> outcomes{};
  for (int i = 0; i < 20'000; ++i) {
    Ring ring;
    const std::size_t corners = 4 + random() % 6;
    for (std::size_t k = 0; k < corners; ++k)
      ring.emplace_back(static_cast<double>(random() % 4), static_cast<double>(random() % 4), 0.0);
    const Covered covered = cover(ring);
    ++outcomes.at(static_cast<std::size_t>(covered.cut));
    if (covered.cut == PolygonCut::inside) {
      ASSERT_NEAR(covered.area, glm::length(newell(ring)), 1e-12);
      if (covered.triangles > 1) {
        ASSERT_GT(covered.least, 0.0);
      }
    }
  }
  for (const std::size_t count : outcomes) EXPECT_GT(count, 0U);
}

TEST(CutPolygon, WhatHasNoAreaIsTold) {
  EXPECT_EQ(cover(flat({{0, 0}, {1, 0}, {2, 0}, {5, 0}})).cut, PolygonCut::flat);
  EXPECT_EQ(cover(flat({{0, 0}, {1, 1}, {2, 2}, {1, 1}})).cut, PolygonCut::flat);
  EXPECT_EQ(cover(flat({{0, 0}, {0, 0}, {1, 0}, {1, 0}})).cut, PolygonCut::nothing);
  const Covered triangle = cover(flat({{0, 0}, {1, 0}, {1, 0}, {0, 1}, {0, 0}}));
  EXPECT_EQ(triangle.cut, PolygonCut::inside);
  EXPECT_EQ(triangle.triangles, 1U) << "a triangle, written with five corners";
}

}  // namespace
