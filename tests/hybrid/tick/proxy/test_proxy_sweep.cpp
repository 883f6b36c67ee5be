// SPDX-License-Identifier: GPL-3.0-or-later
// The proxy on rigid objects alone. Depth and direction are compared with closed forms, first-order
// conditions are checked against every triangle of a mesh, and nothing may be penetrated.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <limits>
#include <optional>
#include <random>

#include "hybrid/tick/proxy/proxy_sweep.h"
#include "polygon/files/mesh_file.h"
#include "polygon/mesh/triangle.h"
#include "polygon/surface/primitives.h"
#include "tests/hybrid/fixtures/touch.h"

namespace {

using glm::dvec3;
using hybrid::Scene;
using hybrid::TickResult;
using tests::Touch;

constexpr double kStiffness = 1000.0;

// A scene of rigid objects only, in SI units.
Scene scene_of(std::vector<hybrid::RigidDescription> rigid, double tool_radius) {
  Scene scene;
  scene.file = "in the test";
  scene.rigid = std::move(rigid);
  scene.tool = {.shape = hybrid::Tool::Shape::ball, .radius_m = tool_radius, .stiffness_N_per_m = kStiffness};
  scene.device_model = device::DeviceModel::ideal;
  scene.max_force_given = true;
  scene.safety = {.max_force_N = 1e9, .max_slew_N_per_s = 1e15, .soft_start_s = 0.0};
  return scene;
}

hybrid::RigidDescription object(const std::string& name, hybrid::RigidSource source,
                                const dvec3& at = dvec3(0.0), const dvec3& axis = {0, 0, 1},
                                double degrees = 0.0) {
  return {.name = name,
          .source = std::move(source),
          .pose = {at, glm::angleAxis(glm::radians(degrees), axis)},
          .place = {},
          .source_place = {}};
}

dvec3 random_direction(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const double x = normal(random), y = normal(random), z = normal(random);
  return glm::normalize(dvec3(x, y, z));
}

class RigidSweep : public tests::SceneFile {
 protected:
  // A mesh that is written to a file and read again, as in a user's scene.
  hybrid::RigidDescription mesh(const std::string& name, const polygon::TriangleMesh& m) const {
    polygon::save_ply(folder_ / (name + ".ply"), m);
    return object(name, hybrid::MeshSource{.file = folder_ / (name + ".ply")});
  }
  std::mt19937_64 random{4711};
};

TEST_F(RigidSweep, ABallPressesBackWithTheCouplingTimesTheDepth) {
  Touch touch(scene_of({object("ball", hybrid::BallPrimitive{0.02})}, 5e-3), {0, 0, 0.1});
  for (int n = 0; n < 20; ++n) {
    const dvec3 out = random_direction(random);
    touch.go(0.1 * out, 2e-3);
    for (const double depth : {1e-3, 3e-3, 5e-3}) {
      const TickResult felt = touch.go((0.025 - depth) * out, 1e-3, 2);
      EXPECT_LE(glm::length(felt.force_N - kStiffness * depth * out), 1e-6 * kStiffness * depth);
      EXPECT_EQ(felt.contacts, 1U);
    }
    touch.go(0.1 * out, 2e-3);
  }
  EXPECT_EQ(touch.state().faults, 0U);
}

// Every vertex is on the sphere. The centre of a facet is deeper by at most edge²/(6R). So the facets may
// differ by this much from the exact depth.
TEST_F(RigidSweep, ABallOfFacetsDoesSoWithinOnePercent) {
  const double radius = 0.02;
  const auto icosphere = polygon::make_ball_mesh(radius, 6);
  const auto& t = icosphere.triangles.front();
  const double edge = glm::length(icosphere.vertices[t[0]] - icosphere.vertices[t[1]]);
  ASSERT_LT(1.5 * edge * edge / (6.0 * radius),
            0.01 * 1e-3);  // the error, times 1.5, is below one percent of the smallest depth
  Touch touch(scene_of({mesh("ball", icosphere)}, 5e-3), {0, 0, 0.1});
  for (int n = 0; n < 20; ++n) {
    const dvec3 out = random_direction(random);
    touch.go(0.1 * out, 2e-3);
    for (const double depth : {1e-3, 3e-3, 5e-3}) {
      const TickResult felt = touch.go((0.025 - depth) * out, 1e-3, 2);
      EXPECT_NEAR(glm::length(felt.force_N), kStiffness * depth, 0.01 * kStiffness * depth);
      // The slope of a facet turns the force. A finger joint can resolve 2.5 degrees.
      EXPECT_GT(glm::dot(glm::normalize(felt.force_N), out), std::cos(glm::radians(2.5)));
    }
    touch.go(0.1 * out, 2e-3);
  }
  EXPECT_EQ(touch.state().faults, 0U);
}

class BoxContact : public RigidSweep, public ::testing::WithParamInterface<bool> {};

TEST_P(BoxContact, FaceEdgeAndCorner) {
  const dvec3 half(0.03, 0.02, 0.01);
  const double r = 8e-3;
  const auto box = GetParam() ? mesh("box", polygon::make_box_mesh(half, 8))
                              : object("box", hybrid::BoxPrimitive{2.0 * half});
  struct Case {
    dvec3 at, out;  // a point of the surface, and an outward direction
  };
  const std::array<Case, 6> cases{{{{0.0, 0.0, half.z}, {0, 0, 1}},
                                   {{half.x, 0.0011, 0.0023}, {1, 0, 0}},
                                   {{0.0123, half.y, 0.0}, {0, 1, 0}},
                                   {{half.x, 0.0031, half.z}, glm::normalize(dvec3(1, 0, 2))},
                                   {{0.0017, -half.y, -half.z}, glm::normalize(dvec3(0, -3, -1))},
                                   {half, glm::normalize(dvec3(1, 2, 3))}}};
  Touch touch(scene_of({box}, r), {0, 0, 0.1});
  for (const Case& c : cases) {
    touch.go({0, 0, 0.1}, 2e-3);
    touch.go(0.1 * glm::normalize(c.at + 0.05 * c.out), 2e-3);
    touch.go(c.at + 0.05 * c.out, 2e-3);
    for (const double depth :
         {1e-3, 3e-3,
          5e-3}) {  // less than r, so the tool's centre stays outside and the force is along c.out
      const TickResult felt = touch.go(c.at + (r - depth) * c.out, 1e-3, 2);
      EXPECT_LE(glm::length(felt.force_N - kStiffness * depth * c.out), 1e-5 * kStiffness * depth)
          << c.at.x << ' ' << c.at.y << ' ' << c.at.z;
    }
    touch.go(c.at + 0.05 * c.out, 2e-3);
    touch.go(0.1 * glm::normalize(c.at + 0.05 * c.out), 2e-3);
  }
  EXPECT_EQ(touch.state().faults, 0U);
}
INSTANTIATE_TEST_SUITE_P(ExactAndOfTriangles, BoxContact, ::testing::Bool());

class Sheet : public RigidSweep, public ::testing::WithParamInterface<bool> {
 protected:
  Scene sheet() const {
    const auto plane = GetParam() ? mesh("sheet", polygon::make_plane_mesh(0.5, 40))
                                  : object("sheet", hybrid::PlanePrimitive{1.0});
    return scene_of({plane}, 2e-3);
  }
};

TEST_P(Sheet, StrokesAtTwoMetersASecondNeverGetThrough) {
  std::uniform_real_distribution<double> place(-0.3, 0.3);
  Touch touch(sheet(), {0, 0, 0.05});
  for (int n = 0; n < 40; ++n) {
    const double side = touch.state().proxy_m.z > 0.0 ? 1.0 : -1.0;
    const dvec3 to(place(random), place(random), -0.05 * side);
    touch.go(to, 2e-3, 1,
             [&](const TickResult& felt) { ASSERT_GE(side * felt.proxy_m.z, 2e-3 * (1.0 - 1e-9)) << n; });
    const TickResult pressed = touch.at(to);
    EXPECT_NEAR(pressed.force_N.z, side * kStiffness * 0.052, 1e-6);
    // The tool moves back on the same side, and around the edge to the other side for the next stroke.
    touch.go({place(random), place(random), 0.05 * side}, 2e-3, 1,
             [&](const TickResult& felt) { ASSERT_GT(side * felt.proxy_m.z, 0.0); });
    touch.go({0.6, 0.0, 0.05 * side}, 2e-3);
    touch.go({0.6, 0.0, -0.05 * side}, 2e-3);
    const TickResult other = touch.go({0.0, 0.0, -0.05 * side}, 2e-3);
    ASSERT_NEAR(glm::length(other.force_N), 0.0, 1e-9) << "the way round the edge is free";
  }
  EXPECT_EQ(touch.state().faults, 0U);
  EXPECT_EQ(touch.state().truncated_ticks, 0U);
}

TEST_P(Sheet, AJumpOfAMeterInATickDoesNotEither) {
  std::uniform_real_distribution<double> place(-0.3, 0.3);
  for (const double side : {1.0, -1.0}) {
    Touch touch(sheet(), {0, 0, 0.5 * side});
    for (int n = 0; n < 200; ++n) {
      const double z = n % 2 == 0 ? -0.5 * side : 0.5 * side;
      const dvec3 to(place(random), place(random), z);
      const TickResult felt = touch.at(to);
      ASSERT_GE(side * felt.proxy_m.z, 2e-3 * (1.0 - 1e-9)) << n;
      for (int wait = 0; wait < 3; ++wait) touch.at(to);
      // If the device is behind the sheet, the proxy is on the sheet, straight in front of the device. This
      // holds wherever the device jumped to.
      const dvec3 on_sheet(to.x, to.y, n % 2 == 0 ? 2e-3 * side : z);
      EXPECT_LE(glm::length(touch.state().proxy_m - on_sheet), 1e-6) << n;
    }
    EXPECT_EQ(touch.state().faults, 0U);
  }
}
INSTANTIATE_TEST_SUITE_P(ExactAndOfTriangles, Sheet, ::testing::Bool());

// A scene of three sheets that cross in one point and form a concave corner.
Scene corner_scene(double scale, const dvec3& offset) {
  const double size = 0.2 * scale;
  Scene scene = scene_of({object("floor", hybrid::PlanePrimitive{size}, offset),
                          object("left", hybrid::PlanePrimitive{size}, offset, {0, 1, 0}, 90.0),
                          object("back", hybrid::PlanePrimitive{size}, offset, {1, 0, 0}, 90.0)},
                         2e-3 * scale);
  return scene;
}

TEST_F(RigidSweep, AConcaveCornerHoldsTheToolOnAllThreeSides) {
  Touch touch(corner_scene(1.0, dvec3(0.0)), {0.03, 0.03, 0.03});
  const TickResult felt = touch.go({-3e-3, -1e-3, -5e-3}, 1e-3, 2);
  EXPECT_LE(glm::length(felt.proxy_m - dvec3(2e-3)), 1e-9);
  EXPECT_LE(glm::length(felt.force_N - dvec3(5.0, 3.0, 7.0)), 1e-6);
  EXPECT_EQ(felt.contacts, 7U);
  // The tool moves fast along two of the sheets into the third.
  touch.go({0.05, -4e-3, -4e-3}, 2e-3);
  const TickResult again = touch.go({-6e-3, -4e-3, -4e-3}, 2e-3, 2);
  EXPECT_LE(glm::length(again.proxy_m - dvec3(2e-3)), 1e-9);
}

TEST_F(RigidSweep, ManyWalksInTheCornerNeverLeaveIt) {
  Touch touch(corner_scene(1.0, dvec3(0.0)), {0.03, 0.03, 0.03});
  std::uniform_real_distribution<double> place(-0.04, 0.05);
  for (int n = 0; n < 500; ++n) {
    const dvec3 to(place(random), place(random), place(random));
    const double step = n % 3 == 0 ? 1.0 : 2e-3;  // jumps and strokes
    touch.go(to, step, 2, [&](const TickResult& felt) {
      for (int d = 0; d < 3; ++d) ASSERT_GE(felt.proxy_m[d], 2e-3 * (1.0 - 1e-9)) << n;
    });
    // The free space of the corner is convex, so the constrained minimum is the device's position clamped to
    // it.
    ASSERT_LE(glm::length(touch.state().proxy_m - glm::max(to, dvec3(2e-3))), 1e-6) << n;
  }
  EXPECT_EQ(touch.state().faults, 0U);
}

// The same motion in scenes of other sizes and places must give proportional results.
TEST_F(RigidSweep, SizeAndPlaceOfTheSceneDoNotMatter) {
  struct Where {
    double scale;
    dvec3 offset;
    double rounding;  // rounding of a coordinate, relative to the scale; a hundred of them may add up
  };
  const std::array<Where, 5> places{{{1e-3, dvec3(0.0), 1e-12},
                                     {1.0, dvec3(0.0), 1e-12},
                                     {1e3, dvec3(0.0), 1e-12},
                                     {1.0, dvec3(1e6, -1e6, 1e6), 3e-8},
                                     {1e3, dvec3(1e6, 1e6, 1e6), 1e-10}}};
  const std::array<dvec3, 8> path{{{0.03, 0.03, -3e-3},
                                   {0.005, 0.03, -3e-3},
                                   {-2e-3, -4e-3, -3e-3},
                                   {-2e-3, 0.02, 0.01},
                                   {0.05, 0.05, 0.05},
                                   {-0.01, -0.01, -0.01},
                                   {0.02, -1e-3, 0.03},
                                   {0.03, 0.03, 0.03}}};
  for (const Where& w : places) {
    Touch touch(corner_scene(w.scale, w.offset), w.offset + w.scale * dvec3(0.03));
    for (const dvec3& to : path) {
      const TickResult felt = touch.go(w.offset + w.scale * to, 1e-3 * w.scale, 2);
      const dvec3 proxy = (felt.proxy_m - w.offset) / w.scale;
      EXPECT_LE(glm::length(proxy - glm::max(to, dvec3(2e-3))), 1e-9 + 100.0 * w.rounding)
          << "scale " << w.scale << ", offset " << w.offset.x;
    }
    EXPECT_EQ(touch.state().faults, 0U) << "scale " << w.scale << ", offset " << w.offset.x;
  }
  // Repeats the test on a curved mesh, which has planes in all directions.
  std::optional<std::vector<dvec3>> first;
  for (const Where& w : places) {
    auto ball = mesh("ball", polygon::make_ball_mesh(0.02 * w.scale, 4));
    ball.pose.position_m = w.offset;
    Touch touch(scene_of({ball}, 5e-3 * w.scale), w.offset + w.scale * dvec3(0, 0, 0.05));
    std::vector<dvec3> proxies;
    for (int n = 0; n <= 300; ++n) {
      const double angle = 0.01 * n;
      const dvec3 at = 0.022 * dvec3(std::sin(angle), 0.2 * std::sin(3.0 * angle), std::cos(angle));
      proxies.push_back((touch.at(w.offset + w.scale * at).proxy_m - w.offset) / w.scale);
    }
    EXPECT_EQ(touch.state().faults, 0U) << "scale " << w.scale << ", offset " << w.offset.x;
    if (!first) first = proxies;
    double worst = 0.0;
    for (std::size_t n = 0; n < proxies.size(); ++n)
      worst = std::max(worst, glm::length(proxies[n] - (*first)[n]));
    // Rounding moves the planes of the facets. In a shallow valley of facets, the minimum then moves by the
    // square root of this motion.
    EXPECT_LE(worst, 1e-7 + std::sqrt(2.0 * 5e-3 * 100.0 * w.rounding))
        << "scale " << w.scale << ", offset " << w.offset.x;
  }
}

// The least |pull − Σ λ n| with λ >= 0, over all sets of at most three normals.
double unbalanced(const dvec3& pull, const std::vector<dvec3>& normals) {
  double best = glm::length(pull);
  const auto look = [&](const std::vector<std::size_t>& s) {
    // Least squares by the normal equations. Sets of dependent normals are skipped, because a smaller set
    // covers them.
    glm::dmat3 gram(1.0);
    dvec3 right(0.0);
    for (std::size_t i = 0; i < s.size(); ++i) {
      right[static_cast<int>(i)] = glm::dot(normals[s[i]], pull);
      for (std::size_t j = 0; j < s.size(); ++j)
        gram[static_cast<int>(j)][static_cast<int>(i)] = glm::dot(normals[s[i]], normals[s[j]]);
    }
    if (std::fabs(glm::determinant(gram)) < 1e-10) return;
    const dvec3 lambda = glm::inverse(gram) * right;
    dvec3 rest = pull;
    for (std::size_t i = 0; i < s.size(); ++i) {
      if (lambda[static_cast<int>(i)] < 0.0) return;
      rest -= lambda[static_cast<int>(i)] * normals[s[i]];
    }
    best = std::min(best, glm::length(rest));
  };
  for (std::size_t i = 0; i < normals.size(); ++i) {
    look({i});
    for (std::size_t j = i + 1; j < normals.size(); ++j) {
      look({i, j});
      for (std::size_t k = j + 1; k < normals.size(); ++k) look({i, j, k});
    }
  }
  return best;
}

// At a minimum, contact forces of triangles at the distance r balance the device's pull, and no triangle is
// nearer than r.
TEST_F(RigidSweep, FirstOrderConditionsHoldAgainstEveryTriangleAllAlongASlide) {
  const double r = 5e-3;
  const auto icosphere = polygon::make_ball_mesh(0.02, 3);  // 1,280 triangles with edges of 3 mm
  Touch touch(scene_of({mesh("ball", icosphere)}, r), {0, 0, 0.05});
  double worst = 0.0, nearest = 1.0;
  for (int n = 0; n < 3000; ++n) {
    const double angle = 1e-3 * n;  // 23 mm/s at a depth of 2 mm, over faces, edges and corners
    const dvec3 out(std::sin(angle) * std::cos(0.7 * angle), std::sin(angle) * std::sin(0.7 * angle),
                    std::cos(angle));
    const TickResult felt = touch.at(0.023 * out);
    std::vector<dvec3> normals;
    for (const auto& t : icosphere.triangles) {
      const auto& v = icosphere.vertices;
      const auto near = polygon::closest_on_triangle(felt.proxy_m, v[t[0]], v[t[1]], v[t[2]]);
      const double distance = std::sqrt(near.squared_distance);
      nearest = std::min(nearest, distance);
      if (distance > r + 1e-8) continue;
      const dvec3 normal = (felt.proxy_m - near.point) / distance;
      const bool known = std::any_of(normals.begin(), normals.end(),
                                     [&](const dvec3& m) { return glm::length(m - normal) < 1e-9; });
      if (!known) normals.push_back(normal);
    }
    worst = std::max(worst, unbalanced(felt.proxy_m - felt.device_m, normals));
  }
  EXPECT_LE(worst, 1e-6);         // the proxy is within a micrometer of its minimum
  EXPECT_GE(nearest, r - 1e-11);  // the proxy is never nearer to a triangle than r
  EXPECT_EQ(touch.state().truncated_ticks, 0U);
  RecordProperty("worst_m", std::to_string(worst));
  std::printf(
      "first-order conditions: unbalanced by at most %.2e m, nearest triangle %.2e m inside the radius\n",
      worst, r - nearest);
}

// On a convex surface, the proxy must be at the nearest place, whatever its path. Motion back and forth over
// edges must not trap it.
TEST_F(RigidSweep, OnAFinelyFacetedBallTheProxyIsAtTheNearestFace) {
  for (const double r : {0.0, 5e-3}) {
    const auto icosphere = polygon::make_ball_mesh(0.02, 3);
    Touch touch(scene_of({mesh("ball", icosphere)}, r), {0, 0, 0.05});
    const double skin = touch.world().contact_radius_m();
    std::size_t elsewhere = 0, ticks = 0;
    double worst = 0.0;
    for (int n = 0; n < 3000; ++n) {
      const double angle = 1.3e-3 * n;
      const dvec3 out(std::sin(angle) * std::cos(0.7 * angle), std::sin(angle) * std::sin(0.7 * angle),
                      std::cos(angle));
      const TickResult felt = touch.at((0.017 + r) * out);
      double least = 1.0;
      for (const auto& t : icosphere.triangles) {
        const auto& v = icosphere.vertices;
        const dvec3 normal = glm::normalize(glm::cross(v[t[1]] - v[t[0]], v[t[2]] - v[t[0]]));
        least = std::min(least, glm::dot(normal, v[t[0]]) + skin - glm::dot(normal, felt.device_m));
      }
      const double depth = glm::length(felt.proxy_m - felt.device_m);
      ++ticks;
      elsewhere += depth > least * (1.0 + 1e-9) ? 1 : 0;
      worst = std::max(worst, depth / least - 1.0);
    }
    // Normals of neighbouring facets differ by up to 11 degrees. So the depths under them differ by up to 1.8
    // %, and a twentieth of this is allowed as hysteresis. The nearest face may be up to three edges away,
    // around a corner. The first of these edges makes up at least a quarter of the difference, hence the
    // factor 4.
    EXPECT_LE(worst, 4.0 * 0.05 * 0.018) << r;
    EXPECT_LE(elsewhere, ticks / 10) << r;
    EXPECT_EQ(touch.state().truncated_ticks, 0U);
  }
}

// A tool that is pressed on the top of a cube does not cross the edge, however near the side face is.
TEST_F(RigidSweep, ASharpEdgeIsNotCrossed) {
  Touch touch(scene_of({mesh("cube", polygon::make_box_mesh(dvec3(0.02), 4))}, 2e-3), {0, 0, 0.05});
  touch.go({0.015, 0, 0.021}, 1e-3);
  touch.go({0.015, 0, 0.005}, 1e-4);
  touch.go({0.0195, 0, 0.005}, 1e-4, 0, [&](const TickResult& felt) {
    EXPECT_NEAR(felt.proxy_m.z, 0.022, 1e-9);
    EXPECT_NEAR(felt.proxy_m.x, felt.device_m.x, 1e-9);
  });
}

TEST_F(RigidSweep, AFlatMeshIsFlatWhereverTheToolCrossesItsEdges) {
  // Coordinates are rounded to floats, as in some files. So the facets' planes differ by millionths of a
  // radian.
  auto sheet = polygon::make_plane_mesh(0.05, 25);
  for (dvec3& v : sheet.vertices) v = dvec3(glm::vec3(v + dvec3(0.3, -0.2, 0.1)));
  Touch touch(scene_of({mesh("sheet", sheet)}, 5e-3), {0.3, -0.2, 0.15});
  touch.go({0.27, -0.22, 0.102}, 1e-3);
  double worst = 0.0;
  touch.go({0.33, -0.18, 0.102}, 1e-5, 0, [&](const TickResult& felt) {
    worst = std::max(worst, glm::length(felt.proxy_m - dvec3(felt.device_m.x, felt.device_m.y, 0.105)));
  });
  EXPECT_LE(worst, 1e-7);
  EXPECT_EQ(touch.state().faults, 0U);
  EXPECT_EQ(touch.state().truncated_ticks, 0U);
}

// The tops of two boxes lie in one plane. At their seam each box seems to be in the way by rounding.
TEST_F(RigidSweep, AFlatSeamTakesFewSteps) {
  const hybrid::BoxPrimitive box{dvec3(0.04, 0.04, 0.02)};
  Touch touch(
      scene_of({object("left", box, {-0.02, 0, -0.01}), object("right", box, {0.02, 0, -0.01})}, 2e-3),
      {-1e-3, 0, 0.01});
  touch.go({-1e-3, 0, 0.0}, 1e-4);
  std::uint32_t steps = 0, work = 0;
  double worst = 0.0;
  for (int n = -50; n <= 50; ++n) {
    const dvec3 goal(2e-5 * n, 1e-6 * n, 0.0);
    const hybrid::Sweep sweep =
        hybrid::sweep_proxy(touch.world(), touch.state(), touch.state().proxy_m, goal, glm::dmat3(kStiffness),
                            std::numeric_limits<double>::max());
    touch.state().proxy_m = sweep.point;
    steps = std::max(steps, sweep.steps);
    work = std::max(work, sweep.work);
    worst = std::max(worst, glm::length(sweep.point - dvec3(goal.x, goal.y, 2e-3)));
  }
  EXPECT_LE(steps, 32U);
  EXPECT_LE(work, 400U);
  EXPECT_LE(worst, 2.1e-5) << "at most the step of one tick behind";
}

}  // namespace
