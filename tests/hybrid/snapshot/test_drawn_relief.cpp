// SPDX-License-Identifier: GPL-3.0-or-later
// The drawn relief of a rigid surface has the heights that are felt, and stays closed.
#include "hybrid/snapshot/drawn_relief.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <utility>

#include "polygon/surface/primitives.h"

namespace {

using hybrid::HeightTexture;
using hybrid::TextureAlong;
using hybrid::TextureKind;
using hybrid::TexturePattern;
using polygon::TriangleMesh;

constexpr double kPeriod_m = 0.006, kHeight_m = 4e-4, kTop_m = 0.005;

HeightTexture bumps(TextureKind kind) {
  return {TexturePattern::bumps,
          {.kind = kind, .along = TextureAlong::z, .size_m = kPeriod_m, .height_m = kHeight_m}};
}

TriangleMesh plate() {
  return polygon::make_box_mesh({0.015, 0.015, kTop_m}, 1);
}

// Every directed edge of a closed mesh has its opposite exactly once.
bool is_closed(const TriangleMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& t : mesh.triangles) {
    for (std::size_t e = 0; e < 3; ++e) ++edges[{t[e], t[(e + 1) % 3]}];
  }
  for (const auto& [edge, count] : edges) {
    const auto opposite = edges.find({edge.second, edge.first});
    if (count != 1 || opposite == edges.end()) return false;
  }
  return true;
}

TEST(DrawnRelief, HasTheHeightsThatAreFelt) {
  const HeightTexture texture = bumps(TextureKind::height);
  const TriangleMesh drawn = hybrid::with_relief(plate(), texture);
  EXPECT_TRUE(is_closed(drawn));
  int on_top = 0;
  double deepest_m = 0.0, highest_m = -1.0;
  for (const glm::dvec3& v : drawn.vertices) {
    // Vertices on a rim have the normal of an edge. They are not compared.
    if (v.z < 0.5 * kTop_m || std::max(std::abs(v.x), std::abs(v.y)) > 0.014) continue;
    const double felt_m = hybrid::relief_at(texture, {v.x, v.y, kTop_m}, {0.0, 0.0, 1.0}).height_m;
    EXPECT_NEAR(v.z - kTop_m, felt_m, 1e-12);
    deepest_m = std::min(deepest_m, v.z - kTop_m);
    highest_m = std::max(highest_m, v.z - kTop_m);
    ++on_top;
  }
  EXPECT_GT(on_top, 10'000) << "five by five periods, and more than 24 by 24 vertices in each";
  EXPECT_LT(deepest_m, -0.9 * kHeight_m);
  EXPECT_GT(highest_m, -0.1 * kHeight_m);
}

TEST(DrawnRelief, IsScaledByTheShareAndLeavesShadingAlone) {
  const HeightTexture texture = bumps(TextureKind::height);
  const TriangleMesh whole = hybrid::with_relief(plate(), texture),
                     half = hybrid::with_relief(plate(), texture, 0.5),
                     none = hybrid::with_relief(plate(), texture, 0.0);
  ASSERT_EQ(whole.vertices.size(), half.vertices.size());
  for (std::size_t v = 0; v < whole.vertices.size(); ++v)
    EXPECT_LT(glm::distance(half.vertices[v], 0.5 * (whole.vertices[v] + none.vertices[v])), 1e-12);
  EXPECT_EQ(hybrid::with_relief(plate(), bumps(TextureKind::shading)).vertices.size(),
            plate().vertices.size());
}

// A fine texture on a large plate would need millions of triangles.
TEST(DrawnRelief, HasABoundedNumberOfTriangles) {
  const TriangleMesh drawn =
      hybrid::with_relief(polygon::make_box_mesh({0.5, 0.5, 0.005}, 1), bumps(TextureKind::height));
  EXPECT_LE(drawn.triangles.size(), 250'000U);
  EXPECT_GT(drawn.triangles.size(), 60'000U);
  EXPECT_TRUE(is_closed(drawn));
}

}  // namespace
