// SPDX-License-Identifier: GPL-3.0-or-later
// The pose of a rigid object at a given time, the distance that it travels, and the transfer of its motion
// from the scene file into the world.
#include "hybrid/world/rigid_motion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>
#include <limits>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>

#include "hybrid/build/build_world.h"
#include "polygon/surface/primitives.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"

namespace {

using glm::dquat;
using glm::dvec3;
using hybrid::Pose;
using hybrid::RigidDescription;
using hybrid::RigidMotion;

const polygon::TriangleMesh& box() {
  static const polygon::TriangleMesh mesh = polygon::make_box_mesh({0.01, 0.02, 0.03}, 2);
  return mesh;
}

RigidMotion moving(const hybrid::MotionDescription& motion, const Pose& start) {
  RigidDescription description;
  description.name = "body";
  description.source = hybrid::BoxPrimitive{{0.02, 0.04, 0.06}};
  description.motion = motion;
  return {description, start, box(), true};
}

hybrid::FreeMotion free_motion(std::optional<double> mass_kg, std::optional<double> density,
                               std::optional<dvec3> inertia = {}, std::optional<dvec3> centre = {}) {
  hybrid::FreeMotion motion;
  motion.mass_kg = mass_kg;
  motion.density_kg_per_m3 = density;
  motion.inertia_kg_m2 = inertia;
  motion.centre_m = centre;
  return motion;
}

void expect_pose(const Pose& a, const Pose& b, double tolerance = 1e-14) {
  EXPECT_LE(glm::distance(a.position_m, b.position_m), tolerance);
  // q and −q are the same rotation.
  EXPECT_GE(std::fabs(glm::dot(a.rotation, b.rotation)), 1.0 - tolerance);
}

const Pose kStart{{0.1, -0.2, 0.3}, glm::normalize(dquat(0.4, 0.3, -0.6, 0.2))};

TEST(RigidMotion, BeginsWhereTheScenePutIt) {
  const hybrid::PathMotion both{
      device::PressPath{.from_m = {5, 5, 5}, .to_m = {5, 5, 4}, .speed_m_per_s = 0.5},
      hybrid::SpinDescription{{0, 0, 1}, {0.4, 0.1, 0.0}, 3.0, 0.0, 0.0}};
  for (const double t : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    expect_pose(moving(both, kStart).pose_at(t), kStart);
    expect_pose(moving({}, kStart).pose_at(t), kStart);
  }
  expect_pose(moving({}, kStart).pose_at(100.0), kStart);
  EXPECT_FALSE(moving({}, kStart).moves());
  EXPECT_TRUE(moving(both, kStart).moves());
}

TEST(RigidMotion, FollowsItsPathFromThere) {
  const RigidMotion motion = moving(
      hybrid::PathMotion{
          device::PressPath{.from_m = {1, 1, 1}, .to_m = {1, 1, 0.9}, .speed_m_per_s = 0.05, .hold_s = 1.0},
          std::nullopt},
      kStart);
  expect_pose(motion.pose_at(1.0), {kStart.position_m - dvec3(0, 0, 0.05), kStart.rotation});
  expect_pose(motion.pose_at(2.5), {kStart.position_m - dvec3(0, 0, 0.1), kStart.rotation});
  expect_pose(motion.pose_at(4.0), {kStart.position_m - dvec3(0, 0, 0.05), kStart.rotation});
  expect_pose(motion.pose_at(1e9), kStart);
  EXPECT_NEAR(motion.duration_s(), 5.0, 1e-12);
}

TEST(RigidMotion, TurnsAboutItsAxis) {
  const dvec3 axis = glm::normalize(dvec3(1, 2, 3)), about(0.3, 0.0, -0.1);
  const double rate = 2.5;
  const RigidMotion motion =
      moving(hybrid::PathMotion{std::nullopt, hybrid::SpinDescription{axis, about, rate, 0.0, 0.0}}, kStart);
  for (const double t : {0.1, 1.0, 17.0, 86'400.0}) {
    const Pose pose = motion.pose_at(t);
    const dquat turn = glm::angleAxis(std::fmod(rate * t, glm::two_pi<double>()), axis);
    expect_pose(pose, {about + turn * (kStart.position_m - about), turn * kStart.rotation}, 1e-9);
    // The object keeps its distance to every point of the axis.
    for (const double s : {-0.5, 0.0, 0.5}) {
      EXPECT_NEAR(glm::distance(pose.position_m, about + s * axis),
                  glm::distance(kStart.position_m, about + s * axis), 1e-12);
    }
    EXPECT_NEAR(glm::length(pose.rotation), 1.0, 1e-14);
  }
  EXPECT_EQ(motion.duration_s(), std::numeric_limits<double>::infinity());
}

TEST(RigidMotion, SwingsToAndFro) {
  const double most = 0.6;
  const RigidMotion motion = moving(
      hybrid::PathMotion{std::nullopt, hybrid::SpinDescription{{0, 1, 0}, kStart.position_m, 0.0, most, 2.0}},
      kStart);
  expect_pose(motion.pose_at(0.125),
              {kStart.position_m, glm::angleAxis(most, dvec3(0, 1, 0)) * kStart.rotation});
  expect_pose(motion.pose_at(0.25), kStart, 1e-12);
  expect_pose(motion.pose_at(0.375),
              {kStart.position_m, glm::angleAxis(-most, dvec3(0, 1, 0)) * kStart.rotation});
}

TEST(RigidMotion, ItsDisplacementIsBoundedAndHardlyMore) {
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  const RigidMotion motion = moving({}, {});
  for (int n = 0; n < 5000; ++n) {
    const double step = std::pow(10.0, -6.0 + 6.0 * (n % 7) / 6.0);
    const Pose a{{u(random), u(random), u(random)},
                 glm::normalize(dquat(u(random), u(random), u(random), u(random)))};
    const dvec3 axis = glm::normalize(dvec3(u(random), u(random), u(random)));
    const Pose b{a.position_m + step * dvec3(u(random), u(random), u(random)),
                 glm::angleAxis(30.0 * step * u(random), axis) * a.rotation};
    double most = 0.0;
    for (const dvec3& v : box().vertices)
      most = std::max(most, glm::distance(a.position_m + a.rotation * v, b.position_m + b.rotation * v));
    const double bound = motion.displacement_bound(a, b);
    ASSERT_GE(bound, most - 1e-15);
    ASSERT_LE(bound, 2.5 * most + 1e-15);
  }
}

TEST(RigidMotion, OfAFreeBodyHasItsMass) {
  const RigidMotion by_density = moving(free_motion({}, 1000.0), kStart);
  EXPECT_NEAR(by_density.free_body().mass.mass_kg, 0.048, 1e-12);
  const RigidMotion by_mass = moving(free_motion(0.5, {}), kStart);
  const glm::dmat3& inertia = by_mass.free_body().mass.inertia_kg_m2;
  EXPECT_NEAR(inertia[0][0], 0.5 / 12.0 * (0.04 * 0.04 + 0.06 * 0.06), 1e-15);
  const RigidMotion said = moving(free_motion(0.5, {}, dvec3(1e-3, 2e-3, 2.5e-3), dvec3(0.01, 0, 0)), kStart);
  EXPECT_EQ(said.free_body().mass.inertia_kg_m2[1][1], 2e-3);
  EXPECT_EQ(said.free_body().mass.centre_m.x, 0.01);
  // With a centre of mass shifted by d, the computed inertia grows by m d² about axes across the shift, and
  // not about the axis along it.
  const RigidMotion shifted = moving(free_motion(0.5, {}, {}, dvec3(0.01, 0, 0)), kStart);
  EXPECT_NEAR(shifted.free_body().mass.inertia_kg_m2[0][0], inertia[0][0], 1e-15);
  EXPECT_NEAR(shifted.free_body().mass.inertia_kg_m2[1][1], inertia[1][1] + 0.5 * 1e-4, 1e-15);
  expect_pose(said.pose_at(3.0), kStart);
}

TEST(RigidMotion, AnOpenMeshNeedsMassAndInertia) {
  RigidDescription description;
  description.source = hybrid::MeshSource{};
  const auto build = [&](const hybrid::FreeMotion& motion) {
    description.motion = motion;
    return RigidMotion(description, {}, polygon::make_plane_mesh(0.1, 2), false);
  };
  EXPECT_NO_THROW(build(free_motion(1.0, {}, dvec3(1e-3))));
  for (const auto& motion : {free_motion(1.0, {}), free_motion({}, 1e3)}) {
    try {
      (void)build(motion);
      FAIL() << "an open mesh has no volume";
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find("say both mass and inertia"), std::string::npos);
    }
  }
}

class MotionScene : public tests::SceneFile {
 protected:
  static constexpr const char* kBox =
      "format = 1\n[path]\nkind = \"press\"\nfrom = [0, 0, 60]\nto = [0, 0, 30]\n"
      "[[rigid]]\nname = \"box\"\nprimitive = \"box\"\nsize = [20, 40, 60]\nposition = [100, 0, 0]\n";
};

TEST_F(MotionScene, SaysHowAnObjectMoves) {
  const hybrid::Scene fixed = load(kBox + std::string("motion = \"fixed\"\n"));
  EXPECT_TRUE(std::holds_alternative<std::monostate>(fixed.rigid[0].motion));
  EXPECT_TRUE(std::holds_alternative<std::monostate>(load(kBox).rigid[0].motion));

  const hybrid::Scene scene =
      load(kBox +
           std::string("motion = \"path\"\n[rigid.path]\nkind = \"press\"\nfrom = [0, 0, 0]\nto = [0, 0, 5]\n"
                       "speed = 20\n[rigid.spin]\naxis = [0, 0, 2]\nabout = [90, 0, 0]\nrate = 180\n"));
  const auto& path = std::get<hybrid::PathMotion>(scene.rigid[0].motion);
  EXPECT_NEAR(std::get<device::PressPath>(*path.path).speed_m_per_s, 0.02, 1e-15);
  EXPECT_NEAR(path.spin->axis.z, 1.0, 1e-15);
  EXPECT_NEAR(path.spin->about_m.x, 0.09, 1e-15);
  EXPECT_NEAR(path.spin->rate_rad_per_s, glm::pi<double>(), 1e-14);

  const hybrid::Scene swing =
      load(kBox + std::string("motion = \"path\"\nspin = { amplitude = 30, frequency = 2 }\n"));
  const auto& spin = *std::get<hybrid::PathMotion>(swing.rigid[0].motion).spin;
  EXPECT_NEAR(spin.amplitude_rad, glm::pi<double>() / 6.0, 1e-15);
  EXPECT_NEAR(spin.about_m.x, 0.1, 1e-15) << "about the object's own position";

  const hybrid::Scene free =
      load(kBox + std::string("motion = \"free\"\nmass = 0.2\ninertia = [1e-4, 1e-4, 1.5e-4]\ndrag = 0.1\n"
                              "angular_drag = 1e-4\ngravity = [0, 0, -9.81]\ncentre_of_mass = [1, 2, 3]\n"));
  const auto& body = std::get<hybrid::FreeMotion>(free.rigid[0].motion);
  EXPECT_EQ(*body.mass_kg, 0.2);
  EXPECT_EQ(body.inertia_kg_m2->z, 1.5e-4);
  EXPECT_NEAR(body.centre_m->z, 3e-3, 1e-15);
  EXPECT_EQ(body.gravity_m_per_s2.z, -9.81);
  EXPECT_EQ(free.rigid[0].motion_place.line, 11U);
}

TEST_F(MotionScene, BuildsIntoTheWorldAndTheMap) {
  const hybrid::Scene scene =
      load(kBox + std::string("motion = \"path\"\nspin = { axis = [0, 0, 1], rate = 90 }\n"));
  const hybrid::BuiltScene built = hybrid::build_scene(scene);
  const RigidMotion& motion = built.world->rigid[0].motion;
  ASSERT_EQ(motion.kind(), RigidMotion::Kind::path);
  hybrid::OccupancyMap& map = built.state->map;
  // The box reaches 20 mm along y at first, and along x after a second.
  const dvec3 at_y(0.1, 0.02, 0.0), at_x(0.12, 0.0, 0.0), half(1e-4);
  EXPECT_EQ(map.rigid_in(at_y - half, at_y + half), 1U);
  EXPECT_EQ(map.rigid_in(at_x - half, at_x + half), 0U);
  const Pose pose = motion.pose_at(1.0);
  map.move_body(0, pose.position_m, pose.rotation);
  EXPECT_EQ(map.rigid_in(at_y - half, at_y + half), 0U);
  EXPECT_EQ(map.rigid_in(at_x - half, at_x + half), 1U);
}

// The exact surface of a curved primitive is slightly outside its triangles, and the map must cover it too.
TEST_F(MotionScene, TheMapCoversCurvedPrimitives) {
  const std::string shapes =
      "format = 1\n[path]\nkind = \"press\"\nfrom = [0, 0, 90]\nto = [0, 0, 80]\n[occupancy]\ncell = 0.2\n"
      "[[rigid]]\nname = \"ball\"\nprimitive = \"ball\"\nradius = 30\n"
      "[[rigid]]\nname = \"capsule\"\nprimitive = \"capsule\"\nradius = 20\nlength = 30\nposition = [100, 0, "
      "0]\n";
  for (const std::string motion : {"", "motion = \"path\"\nspin = { rate = 90 }\n"}) {
    const hybrid::BuiltScene built = hybrid::build_scene(load(shapes + motion));
    std::mt19937_64 random(9);
    std::normal_distribution<double> u;
    for (int n = 0; n < 20'000; ++n) {
      const dvec3 away = glm::normalize(dvec3(u(random), u(random), u(random)));
      const dvec3 on_ball = 0.03 * away;
      ASSERT_EQ(built.state->map.rigid_in(on_ball, on_ball), 1U) << n;
      const dvec3 on_end = dvec3(0.1, 0.0, away.z > 0.0 ? 0.015 : -0.015) + 0.02 * away;
      ASSERT_EQ(built.state->map.rigid_in(on_end, on_end), 2U) << n;
      const dvec3 round = glm::normalize(dvec3(away.x, away.y, 0.0));
      const dvec3 on_side = dvec3(0.1, 0.0, 0.015 * away.z) + 0.02 * round;
      ASSERT_EQ(built.state->map.rigid_in(on_side, on_side), 2U) << n;
    }
  }
}

TEST_F(MotionScene, AFreeSheetWithoutInertiaIsRefusedAtItsPlace) {
  const std::string text =
      "format = 1\n[path]\nkind = \"press\"\nfrom = [0, 0, 60]\nto = [0, 0, 30]\n"
      "[[rigid]]\nname = \"sheet\"\nprimitive = \"plane\"\nsize = 20\nmotion = \"free\"\nmass = 0.2\n";
  try {
    (void)hybrid::build_scene(load(text));
    FAIL() << "a sheet has no inertia of its own";
  } catch (const hybrid::SceneError& error) {
    EXPECT_NE(std::string(error.what()).find("scene.toml:10:1: "), std::string::npos) << error.what();
  }
  EXPECT_NO_THROW((void)hybrid::build_scene(load(text + "inertia = 1e-5\n")));
}

}  // namespace
