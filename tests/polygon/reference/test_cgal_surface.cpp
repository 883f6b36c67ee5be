// SPDX-License-Identifier: GPL-3.0-or-later
// CGAL's tree against brute force over all triangles, and against Embree.
#include "polygon/reference/cgal_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <limits>
#include <set>
#include <span>
#include <stdexcept>
#include <vector>

#include "polygon/surface/mesh_surface.h"
#include "polygon/surface/primitives.h"
#include "tests/polygon/fixtures/brute_force.h"

namespace {

using namespace polygon;
using glm::dvec3;

TriangleMesh moved(TriangleMesh mesh, double scale, const dvec3& offset) {
  for (dvec3& v : mesh.vertices) v = v * scale + offset;
  return mesh;
}

struct Placement {
  double scale;
  dvec3 offset;
};

class CgalSurfacePlaced : public testing::TestWithParam<Placement> {
 protected:
  [[nodiscard]] double tolerance() const {
    return 8e-16 * (glm::length(GetParam().offset) + 4.0 * GetParam().scale);
  }
  [[nodiscard]] dvec3 random_place(std::mt19937_64& random) const {
    return tests::random_point(random, 1.3 * GetParam().scale) + GetParam().offset;
  }
  [[nodiscard]] std::vector<TriangleMesh> meshes() const {
    std::mt19937_64 random(3);
    std::vector<TriangleMesh> all{tests::random_soup(random, 600, 1.0), make_ball_mesh(1.0, 3),
                                  make_plane_mesh(1.0, 1)};
    for (TriangleMesh& mesh : all) mesh = moved(mesh, GetParam().scale, GetParam().offset);
    return all;
  }
};

INSTANTIATE_TEST_SUITE_P(Scales, CgalSurfacePlaced,
                         testing::Values(Placement{1e-3, dvec3(0.0)}, Placement{1.0, dvec3(0.0)},
                                         Placement{1e3, dvec3(0.0)}, Placement{1.0, dvec3(1e6, 0.0, 0.0)}));

TEST_P(CgalSurfacePlaced, GatherAndNearestAreBruteForce) {
  std::mt19937_64 random(1);
  for (const TriangleMesh& mesh : meshes()) {
    const auto surface = make_cgal_surface(mesh, false);
    std::vector<NearPoint> out(mesh.triangles.size());
    for (int i = 0; i < 60; ++i) {
      const dvec3 p = random_place(random);
      const double radius = 0.4 * GetParam().scale * (i % 7) / 6.0;
      const GatherResult result = surface->gather(p, radius, out);
      ASSERT_TRUE(result.complete);
      double least = std::numeric_limits<double>::infinity();
      std::size_t at = 0;
      for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
        const double expected = tests::triangle_distance(p, mesh, t);
        least = std::min(least, expected);
        const bool reported = at < result.count && out[at].element == t;
        if (expected <= radius - tolerance()) {
          ASSERT_TRUE(reported);
        }
        if (expected > radius + tolerance()) {
          ASSERT_FALSE(reported);
        }
        if (!reported) continue;
        ASSERT_NEAR(out[at].distance, expected, tolerance());
        ASSERT_NEAR(glm::length(p - surface->closest(t, p).point), expected, tolerance());
        ++at;
      }
      ASSERT_EQ(at, result.count) << "sorted by element, each once";
      NearPoint found;
      ASSERT_TRUE(surface->nearest(p, std::numeric_limits<double>::infinity(), found));
      ASSERT_NEAR(found.distance, least, tolerance());
      ASSERT_FALSE(surface->nearest(p, least - 2.0 * tolerance(), found) && least > 2.0 * tolerance());
    }
  }
}

TEST_P(CgalSurfacePlaced, GatherThatOverflowsKeepsTheNearest) {
  std::mt19937_64 random(2);
  const TriangleMesh mesh = meshes()[1];
  const auto surface = make_cgal_surface(mesh, true);
  std::vector<NearPoint> all(mesh.triangles.size()), few(7);
  for (int i = 0; i < 20; ++i) {
    const dvec3 p = random_place(random);
    const std::uint32_t count = surface->gather(p, 2.0 * GetParam().scale, all).count;
    ASSERT_GT(count, few.size());
    const GatherResult result = surface->gather(p, 2.0 * GetParam().scale, few);
    EXPECT_FALSE(result.complete);
    ASSERT_EQ(result.count, few.size());
    std::sort(all.begin(), all.begin() + count, [](const NearPoint& a, const NearPoint& b) {
      return a.distance < b.distance || (a.distance == b.distance && a.element < b.element);
    });
    std::set<std::uint32_t> nearest, kept;
    for (std::size_t k = 0; k < few.size(); ++k) {
      nearest.insert(all[k].element);
      kept.insert(few[k].element);
    }
    EXPECT_EQ(kept, nearest);
  }
}

TEST_P(CgalSurfacePlaced, SurveyMissesNothingAndIsEmbreesToo) {
  std::mt19937_64 random(5);
  for (const TriangleMesh& mesh : meshes()) {
    const auto surface = make_cgal_surface(mesh, false);
    const auto other = make_mesh_surface(mesh, false);
    std::vector<ElementPlane> out(mesh.triangles.size()), others(mesh.triangles.size());
    const auto by_element = [](const ElementPlane& a, const ElementPlane& b) {
      return a.element < b.element;
    };
    for (int i = 0; i < 40; ++i) {
      const dvec3 centre = random_place(random);
      const double radius = 0.5 * GetParam().scale * (i % 5) / 4.0;
      const GatherResult result = surface->survey(centre, radius, centre, out);
      ASSERT_TRUE(result.complete);
      ASSERT_EQ(other->survey(centre, radius, centre, others).count, result.count);
      std::sort(out.begin(), out.begin() + result.count, by_element);
      std::sort(others.begin(), others.begin() + result.count, by_element);
      std::vector<bool> seen(mesh.triangles.size(), false);
      for (std::uint32_t k = 0; k < result.count; ++k) {
        ASSERT_EQ(out[k].element, others[k].element);
        ASSERT_FALSE(seen[out[k].element]) << "each once";
        seen[out[k].element] = true;
        ASSERT_NEAR(surface->support(out[k].element, out[k].normal), out[k].support, 4.0 * tolerance());
        ASSERT_NEAR(glm::length(out[k].normal), 1.0, 1e-14);
      }
      for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        if (tests::triangle_distance(centre, mesh, t) <= radius - tolerance()) {
          ASSERT_TRUE(seen[t]);
        }
      }
      if (result.count > 1) {
        EXPECT_FALSE(surface->survey(centre, radius, centre, std::span(out).first(1)).complete);
      }
    }
  }
}

TEST_P(CgalSurfacePlaced, AnElementsNormalSupportAndShadingAreEmbreesToo) {
  std::mt19937_64 random(6);
  for (const TriangleMesh& mesh : meshes()) {
    const bool ball = mesh.triangles.size() == 1280;
    const auto surface = make_cgal_surface(mesh, ball);
    const auto other = make_mesh_surface(mesh, ball);
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
      const dvec3 n = glm::normalize(tests::random_point(random, 1.0));
      ASSERT_NEAR(surface->support(t, n), other->support(t, n), 4.0 * tolerance());
      double support = -std::numeric_limits<double>::infinity();
      for (const std::uint32_t corner : mesh.triangles[t]) {
        support = std::max(support, glm::dot(n, mesh.vertices[corner]));
      }
      ASSERT_NEAR(surface->support(t, n), support, 4.0 * tolerance());
      ASSERT_LT(glm::length(surface->face_normal(t) - other->face_normal(t)), 1e-12);
      const dvec3 p = surface->closest(t, random_place(random)).point;
      if (!ball) continue;
      const dvec3 radial = glm::normalize(p - GetParam().offset);
      EXPECT_GT(glm::dot(surface->shaded_normal(t, p, radial), radial), std::cos(0.02));
    }
    EXPECT_LT(glm::length(surface->lower() - other->lower()), tolerance());
    EXPECT_LT(glm::length(surface->upper() - other->upper()), tolerance());
  }
}

TEST_P(CgalSurfacePlaced, InsideIsTheWindingNumber) {
  std::mt19937_64 random(7);
  const TriangleMesh mesh = meshes()[1];
  const auto surface = make_cgal_surface(mesh, true);
  for (int i = 0; i < 300; ++i) {
    const dvec3 p = random_place(random);
    ASSERT_EQ(surface->inside(p), tests::winding_number(p, mesh) > 0.5);
  }
  EXPECT_TRUE(surface->inside(GetParam().offset));
  EXPECT_FALSE(make_cgal_surface(mesh, false)->inside(GetParam().offset));
}

TEST(CgalSurface, DuplicatesAreOneElementAndBadInputIsRefused) {
  TriangleMesh mesh = make_plane_mesh(1.0, 1);
  for (int i = 0; i < 1000; ++i) mesh.triangles.push_back(mesh.triangles[static_cast<std::size_t>(i % 2)]);
  const auto surface = make_cgal_surface(mesh, false);
  std::vector<NearPoint> out(16);
  const GatherResult result = surface->gather({0, 0, 0.1}, 1.0, out);
  EXPECT_TRUE(result.complete);
  EXPECT_EQ(result.count, 2U);
  EXPECT_GT(surface->memory_bytes(), mesh.triangles.size() * sizeof(TriangleIndices));

  const double nan = std::numeric_limits<double>::quiet_NaN();
  NearPoint found;
  EXPECT_FALSE(surface->nearest({nan, 0, 0}, 1.0, found));
  EXPECT_FALSE(surface->nearest({0, 0, 0}, nan, found));
  EXPECT_EQ(surface->gather({0, nan, 0}, 1.0, out).count, 0U);
  EXPECT_FALSE(surface->inside({nan, nan, nan}));

  EXPECT_THROW((void)make_cgal_surface(TriangleMesh{}, false), std::invalid_argument);
  mesh.triangles.push_back({0, 1, 99});
  EXPECT_THROW((void)make_cgal_surface(mesh, false), std::invalid_argument);
  mesh.triangles.pop_back();
  mesh.vertices[0].y = nan;
  EXPECT_THROW((void)make_cgal_surface(mesh, false), std::invalid_argument);
}

}  // namespace
