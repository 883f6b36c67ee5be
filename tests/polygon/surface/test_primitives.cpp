// SPDX-License-Identifier: GPL-3.0-or-later
// Primitives and their tessellations against one another, and against their volumes.
#include "polygon/surface/primitives.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>

#include "polygon/repair/check.h"
#include "polygon/surface/mesh_surface.h"
#include "tests/polygon/fixtures/brute_force.h"

namespace {

using namespace polygon;
using std::numbers::pi;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct Shape {
  const char* name;
  std::unique_ptr<RigidSurface> exact;
  TriangleMesh mesh;
  double tessellation_error;  // largest distance of the mesh from the shape
  bool solid;
};

std::vector<Shape> shapes() {
  std::vector<Shape> all;
  all.push_back({"ball", make_ball_surface(0.7), make_ball_mesh(0.7, 5), 6e-4, true});
  all.push_back({"box", make_box_surface({0.3, 0.5, 0.8}), make_box_mesh({0.3, 0.5, 0.8}, 4), 1e-14, true});
  all.push_back({"capsule", make_capsule_surface(0.4, 0.5), make_capsule_mesh(0.4, 0.5, 128), 6e-4, true});
  all.push_back({"capsule without length", make_capsule_surface(0.4, 0.0), make_capsule_mesh(0.4, 0.0, 128),
                 6e-4, true});
  all.push_back({"plane", make_plane_surface(0.9), make_plane_mesh(0.9, 5), 1e-14, false});
  return all;
}

TEST(Primitives, AgreeWithTheirTessellation) {
  std::mt19937_64 random(11);
  for (const Shape& shape : shapes()) {
    SCOPED_TRACE(shape.name);
    const auto mesh = make_mesh_surface(shape.mesh, shape.solid);
    for (int i = 0; i < 2000; ++i) {
      const glm::dvec3 p = tests::random_point(random, 1.5);
      NearPoint exact, meshed;
      ASSERT_TRUE(shape.exact->nearest(p, kInfinity, exact));
      ASSERT_TRUE(mesh->nearest(p, kInfinity, meshed));
      ASSERT_NEAR(glm::length(p - exact.point), meshed.distance, shape.tessellation_error);
      if (meshed.distance > shape.tessellation_error) {
        ASSERT_EQ(shape.exact->inside(p), mesh->inside(p));
      }
      if (shape.exact->inside(p)) {
        ASSERT_EQ(exact.distance, 0.0);
      } else {
        ASSERT_NEAR(exact.distance, glm::length(p - exact.point), 1e-15);
      }
      // The point is on the surface: at distance 0 from the shape and not inside it.
      NearPoint again;
      ASSERT_TRUE(shape.exact->nearest(exact.point, 1e-15, again));
    }
    EXPECT_LE(glm::length(shape.exact->lower() - mesh->lower()), 2.0 * shape.tessellation_error);
    EXPECT_LE(glm::length(shape.exact->upper() - mesh->upper()), 2.0 * shape.tessellation_error);
  }
}

TEST(Primitives, GatherHonoursRadiusAndRoom) {
  std::mt19937_64 random(12);
  for (const Shape& shape : shapes()) {
    SCOPED_TRACE(shape.name);
    std::array<NearPoint, 4> out;
    for (int i = 0; i < 200; ++i) {
      const glm::dvec3 p = tests::random_point(random, 1.5);
      NearPoint nearest;
      ASSERT_TRUE(shape.exact->nearest(p, kInfinity, nearest));
      const GatherResult at = shape.exact->gather(p, nearest.distance, out);
      EXPECT_EQ(at.count, 1U);
      EXPECT_EQ(out[0].element, 0U);
      if (nearest.distance > 0.0) {
        EXPECT_EQ(shape.exact->gather(p, nearest.distance * 0.999, out).count, 0U);
      }
      const GatherResult no_room = shape.exact->gather(p, nearest.distance, {});
      EXPECT_EQ(no_room.count, 0U);
      EXPECT_FALSE(no_room.complete);
    }
    for (const double bad : {kNan, kInfinity}) {
      EXPECT_EQ(shape.exact->gather(glm::dvec3(0.0, bad, 0.0), 1.0, out).count, 0U);
      EXPECT_FALSE(shape.exact->inside(glm::dvec3(bad)));
    }
    EXPECT_EQ(shape.exact->gather(glm::dvec3(0.0), kNan, out).count, 0U);
    EXPECT_EQ(shape.exact->gather(glm::dvec3(0.0), -1.0, out).count, 0U);
  }
}

TEST(Primitives, CentresAndAxesHaveAnAnswer) {
  for (const Shape& shape : shapes()) {
    SCOPED_TRACE(shape.name);
    NearPoint found;
    ASSERT_TRUE(shape.exact->nearest(glm::dvec3(0.0), kInfinity, found));
    EXPECT_TRUE(std::isfinite(glm::length(found.point)));
  }
}

TEST(Primitives, TessellationsAreClosedOutwardAndOfTheRightVolume) {
  struct Case {
    const char* name;
    TriangleMesh mesh;
    double volume, relative_error;
    std::size_t triangles;
  };
  const std::vector<Case> cases{
      {"icosahedron", make_ball_mesh(1.0, 0), 4.0 * pi / 3.0, 0.4, 20},
      {"ball", make_ball_mesh(0.05, 5), 4.0 * pi / 3.0 * 1.25e-4, 3e-3, 20 * 1024},
      {"cube", make_box_mesh(glm::dvec3(0.5), 1), 1.0, 1e-13, 12},
      {"box", make_box_mesh({0.1, 0.7, 1.3}, 7), 8.0 * 0.1 * 0.7 * 1.3, 1e-13, 12 * 49},
      {"capsule", make_capsule_mesh(0.02, 0.03, 200), pi * 4e-4 * 0.06 + 4.0 * pi / 3.0 * 8e-6, 1e-3,
       200 * 200},
      {"capsule without length", make_capsule_mesh(0.02, 0.0, 100), 4.0 * pi / 3.0 * 8e-6, 3e-3, 100 * 98},
      {"least capsule", make_capsule_mesh(1.0, 1.0, 3), 2.0 * pi + 4.0 * pi / 3.0, 0.8, 3 * 4},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.name);
    const MeshCheck check = check_mesh(c.mesh, true);
    for (const Finding& f : check.findings) ADD_FAILURE() << f.id << ": " << f.count << ' ' << f.text;
    EXPECT_TRUE(check.closed);
    EXPECT_TRUE(check.oriented);
    EXPECT_EQ(c.mesh.triangles.size(), c.triangles);
    EXPECT_NEAR(check.volume_m3, c.volume, c.relative_error * c.volume);
    EXPECT_LE(check.volume_m3, c.volume * (1.0 + 1e-12)) << "inscribed";
  }
  for (const glm::dvec3& v : make_ball_mesh(2.0, 4).vertices) EXPECT_NEAR(glm::length(v), 2.0, 1e-15 * 4.0);
}

TEST(Primitives, PlaneLooksUp) {
  const TriangleMesh mesh = make_plane_mesh(0.5, 3);
  EXPECT_EQ(mesh.triangles.size(), 18U);
  for (const TriangleIndices& t : mesh.triangles) {
    const glm::dvec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    EXPECT_GT(glm::cross(b - a, c - a).z, 0.0);
  }
}

TEST(Primitives, RefuseSizesWithTheNumbers) {
  for (const double bad : {0.0, -1.0, kNan, kInfinity}) {
    EXPECT_THROW((void)make_ball_surface(bad), std::invalid_argument);
    EXPECT_THROW((void)make_box_surface({1.0, bad, 1.0}), std::invalid_argument);
    EXPECT_THROW((void)make_capsule_surface(bad, 1.0), std::invalid_argument);
    EXPECT_THROW((void)make_plane_surface(bad), std::invalid_argument);
    EXPECT_THROW((void)make_ball_mesh(bad, 1), std::invalid_argument);
    EXPECT_THROW((void)make_box_mesh({1.0, 1.0, bad}, 1), std::invalid_argument);
    EXPECT_THROW((void)make_capsule_mesh(bad, 1.0, 8), std::invalid_argument);
    EXPECT_THROW((void)make_plane_mesh(bad, 1), std::invalid_argument);
  }
  EXPECT_THROW((void)make_capsule_surface(1.0, -0.1), std::invalid_argument);
  EXPECT_THROW((void)make_ball_mesh(1.0, -1), std::invalid_argument);
  EXPECT_THROW((void)make_ball_mesh(1.0, 10), std::invalid_argument);
  EXPECT_THROW((void)make_box_mesh(glm::dvec3(1.0), 0), std::invalid_argument);
  EXPECT_THROW((void)make_plane_mesh(1.0, 1'000'000), std::invalid_argument);
  EXPECT_THROW((void)make_capsule_mesh(1.0, 1.0, 2), std::invalid_argument);
  try {
    (void)make_ball_surface(-2.5);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("-2.5"), std::string::npos) << error.what();
  }
}

}  // namespace
