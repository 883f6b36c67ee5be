// SPDX-License-Identifier: GPL-3.0-or-later
// Queries of a mesh surface against brute force over all triangles, at several scales and offsets.
#include "polygon/surface/mesh_surface.h"

#include <gtest/gtest.h>

#include <chrono>
#include <glm/geometric.hpp>
#include <limits>
#include <thread>

#include "polygon/files/mesh_file.h"
#include "polygon/surface/primitives.h"
#include "tests/polygon/fixtures/brute_force.h"
#include "tests/shared_data.h"

namespace {

using namespace polygon;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TriangleMesh moved(TriangleMesh mesh, double scale, const glm::dvec3& offset) {
  for (glm::dvec3& v : mesh.vertices) v = v * scale + offset;
  return mesh;
}

struct Placement {
  double scale;
  glm::dvec3 offset;
};

class MeshSurfacePlaced : public testing::TestWithParam<Placement> {
 protected:
  // A few roundings of coordinates of this size.
  [[nodiscard]] double tolerance() const {
    return 8e-16 * (glm::length(GetParam().offset) + 4.0 * GetParam().scale);
  }
};

INSTANTIATE_TEST_SUITE_P(Scales, MeshSurfacePlaced,
                         testing::Values(Placement{1e-3, glm::dvec3(0.0)}, Placement{1.0, glm::dvec3(0.0)},
                                         Placement{1e3, glm::dvec3(0.0)},
                                         Placement{1e-3, glm::dvec3(1e6, -1e6, 1e6)},
                                         Placement{1.0, glm::dvec3(1e6, 0.0, 0.0)},
                                         Placement{1e3, glm::dvec3(-1e6, 1e6, 2e6)}));

TEST_P(MeshSurfacePlaced, GatherIsBruteForce) {
  const auto [scale, offset] = GetParam();
  std::mt19937_64 random(1);
  for (const bool sphere : {false, true}) {
    const TriangleMesh mesh =
        moved(sphere ? make_ball_mesh(1.0, 3) : tests::random_soup(random, 600, 1.0), scale, offset);
    const auto surface = make_mesh_surface(mesh, sphere);
    std::vector<NearPoint> out(mesh.triangles.size());
    std::size_t total = 0;
    for (int i = 0; i < 60; ++i) {
      const glm::dvec3 p = tests::random_point(random, 1.3 * scale) + offset;
      const double radius = 0.4 * scale * (i % 7) / 6.0;
      const GatherResult result = surface->gather(p, radius, out);
      ASSERT_TRUE(result.complete);
      total += result.count;
      std::size_t at = 0;
      for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
        const double expected = tests::triangle_distance(p, mesh, t);
        const bool reported = at < result.count && out[at].element == t;
        if (expected <= radius - tolerance()) {
          ASSERT_TRUE(reported) << "triangle " << t << " at " << expected << " is within " << radius;
        }
        if (expected > radius + tolerance()) {
          ASSERT_FALSE(reported) << "triangle " << t << " at " << expected << " is beyond " << radius;
        }
        if (!reported) continue;
        ASSERT_NEAR(out[at].distance, expected, tolerance());
        ASSERT_NEAR(glm::length(p - out[at].point), out[at].distance, tolerance());
        ++at;
      }
      ASSERT_EQ(at, result.count) << "sorted by element, each once";
    }
    EXPECT_GT(total, 100U);
  }
}

TEST_P(MeshSurfacePlaced, NearestIsBruteForce) {
  const auto [scale, offset] = GetParam();
  std::mt19937_64 random(2);
  const TriangleMesh mesh = moved(tests::random_soup(random, 500, 1.0), scale, offset);
  const auto surface = make_mesh_surface(mesh, false);
  for (int i = 0; i < 100; ++i) {
    const glm::dvec3 p = tests::random_point(random, (i % 10 == 0 ? 50.0 : 1.5) * scale) + offset;
    double expected = kInfinity;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      expected = std::min(expected, tests::triangle_distance(p, mesh, t));
    }
    NearPoint found;
    ASSERT_TRUE(surface->nearest(p, kInfinity, found));
    EXPECT_NEAR(found.distance, expected, 20.0 * tolerance());
    EXPECT_NEAR(tests::triangle_distance(p, mesh, found.element), expected, 20.0 * tolerance());
    EXPECT_TRUE(surface->nearest(p, expected * 1.0001 + tolerance(), found));
    EXPECT_EQ(surface->nearest(p, expected * 0.9999 - tolerance(), found), false);
  }
}

// At distances of hundreds of radii, the distances of all triangles are equal in float.
TEST_P(MeshSurfacePlaced, NearestFromFarAwayIsBruteForce) {
  const auto [scale, offset] = GetParam();
  std::mt19937_64 random(5);
  for (const bool sphere : {false, true}) {
    const TriangleMesh mesh =
        moved(sphere ? make_ball_mesh(1.0, 3) : tests::random_soup(random, 500, 1.0), scale, offset);
    const auto surface = make_mesh_surface(mesh, sphere);
    for (int i = 0; i < 100; ++i) {
      const double away = std::pow(10.0, 2.0 + i % 10);
      const glm::dvec3 p = glm::normalize(tests::random_point(random, 1.0)) * away * scale + offset;
      double expected = kInfinity;
      for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        expected = std::min(expected, tests::triangle_distance(p, mesh, t));
      }
      const double rounding = 20.0 * tolerance() + 1e-14 * away * scale;
      NearPoint found;
      ASSERT_TRUE(surface->nearest(p, kInfinity, found));
      EXPECT_NEAR(found.distance, expected, rounding) << away;
      EXPECT_NEAR(tests::triangle_distance(p, mesh, found.element), expected, rounding) << away;
      EXPECT_TRUE(surface->nearest(p, expected + rounding, found));
      EXPECT_FALSE(surface->nearest(p, expected - rounding, found));
    }
  }
}

TEST_P(MeshSurfacePlaced, InsideIsTheWindingNumber) {
  const auto [scale, offset] = GetParam();
  std::mt19937_64 random(3);
  // A star with spikes. At its acute edges and corners a face's own normal has the wrong sign for nearby
  // points.
  TriangleMesh star = make_ball_mesh(1.0, 2);
  for (std::size_t i = 0; i < star.vertices.size(); ++i) star.vertices[i] *= i % 3 == 0 ? 1.0 : 0.3;
  for (const TriangleMesh& shape :
       {make_ball_mesh(1.0, 2), make_box_mesh(glm::dvec3(0.7, 0.5, 0.9), 3), star}) {
    const TriangleMesh mesh = moved(shape, scale, offset);
    const auto surface = make_mesh_surface(mesh, true);
    const auto sheet = make_mesh_surface(mesh, false);
    int in = 0;
    for (int i = 0; i < 300; ++i) {
      const glm::dvec3 p = tests::random_point(random, 1.1 * scale) + offset;
      const bool expected = tests::winding_number(p, mesh) > 0.5;
      in += expected ? 1 : 0;
      ASSERT_EQ(surface->inside(p), expected) << i;
      ASSERT_FALSE(sheet->inside(p)) << "an open sheet has no inside";
    }
    EXPECT_GT(in, 3);
    // Just outside and just inside of a corner, inside() is right only with pseudonormals.
    for (const glm::dvec3& v : mesh.vertices) {
      const glm::dvec3 d = (v - offset) * 1e-4;
      ASSERT_FALSE(surface->inside(v + d));
      ASSERT_TRUE(surface->inside(v - d));
    }
  }
}

TEST(MeshSurface, BoundsAreThoseOfItsTriangles) {
  TriangleMesh mesh = make_box_mesh(glm::dvec3(1.0, 2.0, 3.0), 2);
  mesh.vertices.emplace_back(100.0, 0.0, 0.0);  // belongs to no triangle
  const auto surface = make_mesh_surface(mesh, true);
  EXPECT_NEAR(glm::length(surface->lower() - glm::dvec3(-1.0, -2.0, -3.0)), 0.0, 1e-14);
  EXPECT_NEAR(glm::length(surface->upper() - glm::dvec3(1.0, 2.0, 3.0)), 0.0, 1e-14);
}

TEST(MeshSurface, RefusesWhatIsNotAMesh) {
  EXPECT_THROW((void)make_mesh_surface({}, false), std::invalid_argument);
  TriangleMesh mesh = make_plane_mesh(1.0, 1);
  mesh.triangles[0][1] = 77;
  EXPECT_THROW((void)make_mesh_surface(mesh, false), std::invalid_argument);
  for (const double bad : {kNan, kInfinity, 1e13}) {
    mesh = make_plane_mesh(1.0, 1);
    mesh.vertices[0].y = bad;
    EXPECT_THROW((void)make_mesh_surface(mesh, false), std::invalid_argument);
  }
}

TEST(MeshSurface, QueriesThatAreNotNumbersFindNothing) {
  const auto surface = make_mesh_surface(make_ball_mesh(1.0, 2), true);
  std::vector<NearPoint> out(1000);
  NearPoint found;
  for (const double bad : {kNan, kInfinity, -kInfinity, 1e300}) {
    for (int axis = 0; axis < 3; ++axis) {
      glm::dvec3 p(0.0);
      p[axis] = bad;
      EXPECT_EQ(surface->gather(p, 1.0, out).count, 0U);
      EXPECT_FALSE(surface->nearest(p, kInfinity, found));
      EXPECT_FALSE(surface->inside(p));
    }
  }
  for (const double bad : {kNan, -1.0, -kInfinity}) {
    EXPECT_EQ(surface->gather(glm::dvec3(1.0, 0.0, 0.0), bad, out).count, 0U);
    EXPECT_FALSE(surface->nearest(glm::dvec3(1.0, 0.0, 0.0), bad, found));
  }
  for (const double far : {1e3, 1e9, 1e15}) {
    EXPECT_EQ(surface->gather(glm::dvec3(far, 0.0, 0.0), kInfinity, out).count, 320U);
    ASSERT_TRUE(surface->nearest(glm::dvec3(far, 0.0, 0.0), kInfinity, found));
    EXPECT_NEAR(found.distance, far, 1.01);
  }
}

TEST(MeshSurface, FullOutputKeepsTheNearest) {
  std::mt19937_64 random(4);
  const TriangleMesh mesh = tests::random_soup(random, 800, 1.0);
  const auto surface = make_mesh_surface(mesh, false);
  std::vector<NearPoint> all(mesh.triangles.size());
  for (int i = 0; i < 40; ++i) {
    const glm::dvec3 p = tests::random_point(random, 1.0);
    const std::uint32_t count = surface->gather(p, 0.6, all).count;
    ASSERT_GT(count, 8U);
    std::vector<NearPoint> nearest(all.begin(), all.begin() + count);
    std::sort(nearest.begin(), nearest.end(), [](const NearPoint& a, const NearPoint& b) {
      return std::pair(a.distance, a.element) < std::pair(b.distance, b.element);
    });
    std::array<NearPoint, 8> few;
    const GatherResult result = surface->gather(p, 0.6, few);
    EXPECT_FALSE(result.complete);
    ASSERT_EQ(result.count, few.size());
    for (std::size_t k = 0; k < few.size(); ++k) {
      EXPECT_EQ(std::count_if(nearest.begin(), nearest.begin() + few.size(),
                              [&](const NearPoint& n) { return n.element == few[k].element; }),
                1);
      if (k > 0) {
        EXPECT_LT(few[k - 1].element, few[k].element);
      }
    }
    // The answer is complete if the output has exactly the size that is needed.
    std::vector<NearPoint> exact(count);
    EXPECT_TRUE(surface->gather(p, 0.6, exact).complete);
    const GatherResult none = surface->gather(p, 0.6, {});
    EXPECT_EQ(none.count, 0U);
    EXPECT_FALSE(none.complete);
  }
}

TEST(MeshSurface, SameAnswersOnManyThreadsAndForEveryBuild) {
  std::mt19937_64 random(5);
  const TriangleMesh mesh = tests::random_soup(random, 20'000, 1.0);
  std::vector<glm::dvec3> points;
  points.reserve(200);
  for (int i = 0; i < 200; ++i) points.push_back(tests::random_point(random, 1.0));
  const auto answers = [&points](const RigidSurface& surface) {
    std::vector<double> bits;
    std::array<NearPoint, 32> out;
    for (const glm::dvec3& p : points) {
      const GatherResult result = surface.gather(p, 0.2, out);
      for (const NearPoint& n : std::span(out).first(result.count))
        bits.insert(bits.end(), {n.distance, n.point.x});
      NearPoint nearest;
      if (surface.nearest(p, 1.0, nearest)) bits.push_back(nearest.element);
    }
    return bits;
  };
  const auto first = make_mesh_surface(mesh, false);
  const std::vector<double> expected = answers(*first);
  for (int build = 0; build < 3; ++build) EXPECT_EQ(answers(*make_mesh_surface(mesh, false)), expected);
  std::array<std::vector<double>, 4> seen;
  {
    std::vector<std::jthread> threads;
    threads.reserve(seen.size());
    for (std::vector<double>& s : seen) threads.emplace_back([&] { s = answers(*first); });
  }
  for (const std::vector<double>& s : seen) EXPECT_EQ(s, expected);
}

TEST(MeshSurface, AMillionCoincidentTrianglesAreOneElement) {
  TriangleMesh mesh = make_plane_mesh(1.0, 1);
  const TriangleIndices first = mesh.triangles[0];
  for (std::uint32_t i = 0; i < 1'000'000; ++i) {
    mesh.triangles.push_back(
        {first[(i + 0) % 3], first[(i + (i % 2 != 0U ? 2 : 1)) % 3], first[(i + (i % 2 != 0U ? 1 : 2)) % 3]});
  }
  const auto surface = make_mesh_surface(mesh, false);
  std::array<NearPoint, 8> out;
  const GatherResult result = surface->gather(glm::dvec3(0.5, -0.5, 0.1), 0.2, out);
  EXPECT_TRUE(result.complete);
  ASSERT_EQ(result.count, 1U);
  EXPECT_EQ(out[0].element, 0U);
}

TEST(MeshSurface, SliverAcrossAnEdgeDoesNotHideTheInside) {
  // A box with a T-junction at one edge, which a degenerate triangle closes.
  TriangleMesh mesh = make_box_mesh(glm::dvec3(1.0), 1);
  const TriangleIndices t = mesh.triangles[0];
  const auto middle = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.push_back(0.5 * (mesh.vertices[t[0]] + mesh.vertices[t[1]]));
  mesh.triangles[0] = {t[0], middle, t[2]};
  mesh.triangles.push_back({middle, t[1], t[2]});
  mesh.triangles.push_back({t[0], t[1], middle});
  const auto surface = make_mesh_surface(mesh, true);
  std::mt19937_64 random(6);
  for (int i = 0; i < 200; ++i) {
    const glm::dvec3 p = mesh.vertices[middle] + tests::random_point(random, 0.1);
    EXPECT_EQ(surface->inside(p), tests::winding_number(p, mesh) > 0.5);
  }
}

TEST(MeshSurface, BuildsAMillionTrianglesAndSaysWhatTheyTake) {
  const TriangleMesh mesh = make_ball_mesh(0.05, 8);  // 1.3 million triangles
  const auto before = std::chrono::steady_clock::now();
  const auto surface = make_mesh_surface(mesh, true);
  const std::chrono::duration<double> build = std::chrono::steady_clock::now() - before;
  RecordProperty("build_s", std::to_string(build.count()));
  RecordProperty("memory_bytes", std::to_string(surface->memory_bytes()));
  std::printf("built %zu triangles in %.2f s, %.0f MB\n", mesh.triangles.size(), build.count(),
              static_cast<double>(surface->memory_bytes()) * 1e-6);
  EXPECT_GT(surface->memory_bytes(), mesh.triangles.size() * 50);
  EXPECT_LT(surface->memory_bytes(), mesh.triangles.size() * 500);

  std::mt19937_64 random(7);
  std::array<NearPoint, 2048> out;
  std::vector<double> micros;
  for (int i = 0; i < 2000; ++i) {
    const glm::dvec3 p = glm::normalize(tests::random_point(random, 1.0)) * 0.0505;
    const auto start = std::chrono::steady_clock::now();
    const GatherResult result = surface->gather(p, 1e-3, out);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
    micros.push_back(took.count() * 1e6);
    ASSERT_TRUE(result.complete);
    ASSERT_GT(result.count, 0U);
    ASSERT_EQ(surface->inside(p), false);
    ASSERT_EQ(surface->inside(p * 0.98), true);
  }
  std::sort(micros.begin(), micros.end());
  std::printf("gather within 1 mm: p50 %.1f us, p99 %.1f us\n", micros[1000], micros[1980]);
}

}  // namespace
