// SPDX-License-Identifier: GPL-3.0-or-later
// Places spread over a surface, and values between them.
#include "hybrid/models/surface_places.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

namespace {

using hybrid::SurfacePlaces;

// Two square sheets of 20 x 20 mm. The upper one lies in the plane z = 0 and faces upwards. The lower one
// lies `apart_m` below the plane and faces downwards.
polygon::TriangleMesh two_sheets(double apart_m) {
  constexpr int cells = 20;
  constexpr double cell_m = 1e-3;
  polygon::TriangleMesh mesh;
  for (const double z : {0.0, -apart_m}) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (int j = 0; j <= cells; ++j) {
      for (int i = 0; i <= cells; ++i) mesh.vertices.emplace_back(cell_m * i, cell_m * j, z);
    }
    for (std::uint32_t j = 0; j < cells; ++j) {
      for (std::uint32_t i = 0; i < cells; ++i) {
        const std::uint32_t a = first + j * (cells + 1) + i, b = a + 1, c = a + cells + 1, d = c + 1;
        const bool up = z == 0.0;
        mesh.triangles.push_back(up ? polygon::TriangleIndices{a, b, d} : polygon::TriangleIndices{a, d, b});
        mesh.triangles.push_back(up ? polygon::TriangleIndices{a, d, c} : polygon::TriangleIndices{a, c, d});
      }
    }
  }
  return mesh;
}

TEST(SurfacePlaces, CoverASurfaceEvenlyHoweverManyThereAre) {
  const polygon::TriangleMesh mesh = two_sheets(0.5e-3);
  SurfacePlaces places(mesh, 4e-3);
  std::vector<glm::dvec3> given;
  double before_m = std::numeric_limits<double>::infinity();
  while (const auto place = places.next(2e-3)) {
    for (const glm::dvec3& other : given) {
      if ((other.z == 0.0) == (place->at_m.z == 0.0)) {
        EXPECT_GE(glm::distance(other, place->at_m), 0.999 * std::min(before_m, 1.0)) << given.size();
      }
    }
    EXPECT_NEAR(place->outward.z, place->at_m.z == 0.0 ? 1.0 : -1.0, 1e-12);
    given.push_back(place->at_m);
    EXPECT_LE(places.gap_m(), before_m);
    before_m = places.gap_m();
  }
  EXPECT_LE(places.gap_m(), 2e-3);
  // Discs of 2 mm radius around the places cover the sheets, which bounds their number from below. Discs of
  // half this radius do not overlap and stay within a rim of 1 mm, which bounds the number from above.
  EXPECT_GT(given.size(), 2U * 400U / 13U);
  EXPECT_LT(given.size(), 2U * 484U / 3U);
  double area_m2 = 0.0;
  for (const double area : places.areas_m2()) area_m2 += area;
  EXPECT_NEAR(area_m2, 2.0 * 4e-4, 1e-12);
}

TEST(SurfacePlaces, SpreadValuesWithoutTakingThemThroughAThinObject) {
  const polygon::TriangleMesh mesh = two_sheets(0.5e-3);
  SurfacePlaces places(mesh, 4e-3);
  std::vector<float> values;
  while (const auto place = places.next(1.5e-3))
    values.push_back(static_cast<float>(place->at_m.z == 0.0 ? 1e3 * place->at_m.x : 100.0));
  const std::vector<float> spread = places.spread(values);
  ASSERT_EQ(spread.size(), mesh.vertices.size());
  for (std::size_t v = 0; v < spread.size(); ++v) {
    if (mesh.vertices[v].z == 0.0) {
      EXPECT_NEAR(spread[v], 1e3 * mesh.vertices[v].x, 1.5) << "a linear course, within a gap";
    } else {
      EXPECT_FLOAT_EQ(spread[v], 100.0F);
    }
  }
}

TEST(SurfacePlaces, KeepWhatIsNotKnown) {
  polygon::TriangleMesh mesh = two_sheets(0.5e-3);
  mesh.vertices.emplace_back(1.0, 1.0, 1.0);  // belongs to no triangle
  SurfacePlaces places(mesh, 4e-3);
  EXPECT_TRUE(std::isnan(places.spread({})[0]));
  std::vector<float> values;
  while (const auto place = places.next(1.5e-3))
    values.push_back(place->at_m.x < 0.01 ? std::numeric_limits<float>::quiet_NaN() : 2.0F);
  const std::vector<float> spread = places.spread(values);
  for (std::size_t v = 0; v + 1 < spread.size(); ++v) {
    if (mesh.vertices[v].x < 0.008) {
      EXPECT_TRUE(std::isnan(spread[v]));
    }
    if (mesh.vertices[v].x > 0.012) {
      EXPECT_FLOAT_EQ(spread[v], 2.0F);
    }
  }
  EXPECT_TRUE(std::isnan(spread.back()));
  // Values of a single place can be spread too.
  SurfacePlaces few(mesh, 4e-3);
  (void)few.next(0.0);
  const std::vector<float> one{3.0F};
  EXPECT_FLOAT_EQ(few.spread(one)[7], 3.0F);
  SurfacePlaces none(polygon::TriangleMesh{}, 1.0);
  EXPECT_FALSE(none.next(0.0).has_value());
}

}  // namespace
