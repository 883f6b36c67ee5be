// SPDX-License-Identifier: GPL-3.0-or-later
// The force towards the nearest surface: its values, and the cases in which it fails (thesis, Fig 18) but a
// proxy does not (Fig 19).
#include "hybrid/compare/nearest_surface_rendering.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <vector>

#include "hybrid/compare/compare.h"
#include "polygon/surface/mesh_surface.h"
#include "polygon/surface/primitives.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"

namespace {

using hybrid::ClassicForce;
using hybrid::nearest_surface_force;

constexpr double kStiffness = 800.0, kRadius = 1e-3;

ClassicForce on(const polygon::RigidSurface& surface, const glm::dvec3& device,
                const hybrid::Pose& pose = {}) {
  return nearest_surface_force(surface, pose, device, kRadius, kStiffness);
}

TEST(ClassicSurface, OutsideAndShallowItIsTheProxysForce) {
  const auto box = polygon::make_box_surface(glm::dvec3(0.02));
  EXPECT_FALSE(on(*box, {0.0, 0.0, 0.0215}).contact);
  EXPECT_EQ(on(*box, {0.0, 0.0, 0.0215}).force_N, glm::dvec3(0.0));
  EXPECT_LT(glm::distance(on(*box, {1e-3, 2e-3, 0.0205}).force_N, glm::dvec3(0.0, 0.0, kStiffness * 5e-4)),
            1e-12);
  EXPECT_LT(glm::distance(on(*box, {1e-3, 2e-3, 0.018}).force_N, glm::dvec3(0.0, 0.0, kStiffness * 3e-3)),
            1e-12);
  const ClassicForce felt = on(*box, {1e-3, 2e-3, 0.018});
  EXPECT_TRUE(felt.contact);
  EXPECT_LT(glm::distance(felt.surface_m, {1e-3, 2e-3, 0.02}), 1e-15);
}

TEST(ClassicSurface, FollowsThePose) {
  const auto box = polygon::make_box_surface(glm::dvec3(0.02));
  const hybrid::Pose pose{.position_m = {0.3, -0.1, 0.2},
                          .rotation = glm::angleAxis(0.7, glm::normalize(glm::dvec3(1.0, 2.0, 3.0)))};
  const glm::dvec3 device(1e-3, 2e-3, 0.018);
  const glm::dvec3 force = on(*box, pose.position_m + pose.rotation * device, pose).force_N;
  EXPECT_LT(glm::distance(force, pose.rotation * on(*box, device).force_N), 1e-10);
}

TEST(ClassicSurface, AMeshAndItsShapeAgree) {
  const glm::dvec3 half(0.03, 0.03, 1e-3);
  const auto box = polygon::make_box_surface(half);
  const auto mesh = polygon::make_mesh_surface(polygon::make_box_mesh(half, 4), true);
  for (int n = -19; n <= 19; ++n) {
    const double z = 1.3e-4 * n + 1e-5;
    const glm::dvec3 device(1.1e-3, 2.3e-3, z);
    EXPECT_LT(glm::distance(on(*box, device).force_N, on(*mesh, device).force_N), 1e-6) << z;
  }
}

// A sheet without thickness. Only a proxy can tell its two sides apart.
TEST(ClassicSurface, ASheetFlipsTheForceInItsMiddle) {
  const auto sheet = polygon::make_plane_surface(0.03);
  EXPECT_NEAR(on(*sheet, {0.0, 0.0, 1e-6}).force_N.z, kStiffness * kRadius, 1e-2);
  EXPECT_NEAR(on(*sheet, {0.0, 0.0, -1e-6}).force_N.z, -kStiffness * kRadius, 1e-2);
  EXPECT_EQ(on(*sheet, glm::dvec3(0.0)).force_N, glm::dvec3(0.0));
}

// Points on the surface of a solid, and its outward normals there.
struct OnSurface {
  glm::dvec3 point, normal;
};

void expect_the_limit_from_either_side(const polygon::RigidSurface& surface, const OnSurface& at) {
  const hybrid::Pose pose{.position_m = {0.3, -0.1, 0.2},
                          .rotation = glm::angleAxis(0.7, glm::normalize(glm::dvec3(1.0, 2.0, 3.0)))};
  const auto force = [&](double height_m, const hybrid::Pose& where) {
    const glm::dvec3 device = at.point + height_m * at.normal;
    return on(surface, where.position_m + where.rotation * device, where).force_N;
  };
  constexpr double kHeight_m = 1e-8;
  // The magnitude of the force changes by K times the height. Its direction changes by the relative rounding
  // of the height, 1e-16 m of 1e-8 m.
  constexpr double kSlack_N = 2.0 * kStiffness * kHeight_m;
  for (const hybrid::Pose& where : {hybrid::Pose{}, pose}) {
    const glm::dvec3 felt = force(0.0, where);
    EXPECT_NEAR(glm::length(felt), kStiffness * kRadius, kSlack_N);
    EXPECT_LT(glm::distance(felt, force(kHeight_m, where)), kSlack_N) << "from outside";
    EXPECT_LT(glm::distance(felt, force(-kHeight_m, where)), kSlack_N) << "from inside";
  }
}

TEST(ClassicSurface, OnASolidTheForceIsTheLimitFromEitherSide) {
  const glm::dvec3 slanted = glm::normalize(glm::dvec3(1.0, 2.0, -3.0));
  const glm::dvec3 across = glm::normalize(glm::dvec3(1.0, -0.3, 0.0));
  const auto round = polygon::make_ball_surface(0.02);
  expect_the_limit_from_either_side(*round, {0.02 * slanted, slanted});
  const auto box = polygon::make_box_surface({0.03, 0.02, 0.01});
  expect_the_limit_from_either_side(*box, {{7e-3, -3e-3, -0.01}, {0.0, 0.0, -1.0}});
  expect_the_limit_from_either_side(*box, {{0.03, 1e-3, 2e-3}, {1.0, 0.0, 0.0}});
  const auto capsule = polygon::make_capsule_surface(0.005, 0.03);
  expect_the_limit_from_either_side(*capsule, {0.005 * across + glm::dvec3(0.0, 0.0, 0.021), across});
  const polygon::TriangleMesh mesh = polygon::make_ball_mesh(0.02, 2);
  const auto facets = polygon::make_mesh_surface(mesh, true);
  for (std::size_t n = 0; n < mesh.triangles.size(); n += 37) {
    const auto& t = mesh.triangles[n];
    const glm::dvec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    expect_the_limit_from_either_side(
        *facets, {0.2 * a + 0.3 * b + 0.5 * c, glm::normalize(glm::cross(b - a, c - a))});
  }
}

class ProxyOrNot : public ::testing::Test {
 protected:
  void feel(const char* scene) {
    comparison_ = hybrid::compare_models(hybrid::load_scene(tests::source_folder / "scenes" / scene), "", {});
  }
  const hybrid::ModelResult& model(const std::string& name) const {
    const auto at = std::find_if(comparison_.models.begin(), comparison_.models.end(),
                                 [&](const auto& m) { return m.name == name; });
    EXPECT_NE(at, comparison_.models.end()) << name;
    return *at;
  }
  hybrid::Comparison comparison_;
};

TEST_F(ProxyOrNot, TheThinPlateThrowsTheToolOutBehindWithoutAProxy) {
  feel("thin-sheet.toml");
  const auto &proxy = model("mesh and proxy").rows, &classic = model("nearest-surface").rows;
  ASSERT_EQ(proxy.size(), classic.size());
  EXPECT_EQ(comparison_.models[comparison_.reference].name, "mesh and proxy")
      << "the closed form of a box does not hold through it";
  double least = 0.0, most = 0.0, least_proxy = 0.0, step = 0.0;
  for (std::size_t n = 0; n < proxy.size(); ++n) {
    least = std::min(least, classic[n].force_N.z);
    most = std::max(most, classic[n].force_N.z);
    least_proxy = std::min(least_proxy, proxy[n].force_N.z);
    if (n > 0) step = std::max(step, std::fabs(proxy[n].force_N.z - proxy[n - 1].force_N.z));
    // The proxy's force belongs to the whole depth, and points to the side from which the tool came.
    const double depth = 2e-3 - proxy[n].device_m.z;
    ASSERT_NEAR(proxy[n].force_N.z, kStiffness * std::max(0.0, depth), 1e-6);
    ASSERT_GE(proxy[n].proxy_m.z, 2e-3 - 1e-9);
  }
  EXPECT_NEAR(most, kStiffness * 2e-3, 0.02);
  EXPECT_NEAR(least, -kStiffness * 2e-3, 0.02) << "turned round, as strong as it was";
  EXPECT_GE(least_proxy, -1e-9);
  EXPECT_LT(step, 0.02);
  EXPECT_GE(model("nearest-surface").direction_p99_deg, 179.0);
}

TEST_F(ProxyOrNot, NearAnEdgeTheForceTurnsOnlyWithoutAProxy) {
  feel("convex-edge.toml");
  const auto &proxy = model("mesh and proxy").rows, &classic = model("nearest-surface").rows;
  double jump = 0.0, step = 0.0, tilt = 0.0;
  for (std::size_t n = 1; n < proxy.size(); ++n) {
    if (proxy[n].device_m.x > 19.9e-3) break;  // beyond the edge there is no face above the device
    jump = std::max(jump, glm::distance(classic[n].force_N, classic[n - 1].force_N));
    step = std::max(step, glm::distance(proxy[n].force_N, proxy[n - 1].force_N));
    tilt = std::max(tilt, glm::length(glm::dvec2(proxy[n].force_N)));
  }
  std::printf("edge: the force changes by at most %.2f N a tick without a proxy, %.3f N with one\n", jump,
              step);
  EXPECT_GT(jump, 5.0) << "a right angle at 4 N";
  EXPECT_LT(step, 0.02);
  EXPECT_LT(tilt, 1e-6) << "straight out of the face that the tool came through";
}

// Over a ball the closed form is valid and is the reference. The nearest surface agrees with it.
TEST_F(ProxyOrNot, OverABallAllAgree) {
  hybrid::Scene scene;
  scene.tool.radius_m = kRadius;
  scene.tool.stiffness_N_per_m = kStiffness;
  scene.rigid.push_back(
      {.name = "ball", .source = hybrid::BallPrimitive{0.02}, .pose = {}, .place = {}, .source_place = {}});
  scene.path = device::PressPath{.from_m = {0.0, 0.0, 0.03}, .to_m = {0.0, 0.0, 0.018}};
  comparison_ = hybrid::compare_models(scene, "", {});
  EXPECT_EQ(comparison_.models[comparison_.reference].name, "rigid closed form");
  // The ball is felt as a mesh. Its facets turn the force of 2.4 N by up to 2.6 degrees.
  EXPECT_LT(model("nearest-surface").max_N, 0.12);
}

}  // namespace
