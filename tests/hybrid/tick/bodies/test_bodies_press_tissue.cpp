// SPDX-License-Identifier: GPL-3.0-or-later
// Bodies on a path beside tissue. The tissue gives way and returns, and nothing overlaps after any tick.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>
#include <limits>
#include <string>
#include <vector>

#include "polygon/files/mesh_file.h"
#include "polygon/surface/primitives.h"
#include "polygon/surface/signed_distance.h"
#include "tests/hybrid/fixtures/overlap_checker.h"
#include "tests/hybrid/fixtures/touch.h"
#include "voxel/chain/chainmail.h"

namespace {

using glm::dvec3;
using tests::Touch;

constexpr dvec3 kFarAway(0.0, 0.0, 0.2);
constexpr double kSpacing = 2e-3;
constexpr double kOverlap = 0.05;  // largest allowed overlap (spacings)
constexpr double kBack_m = 1e-3 * kSpacing;
constexpr double kLinks_m = 1e-8;

struct Shape {
  const char* name;
  std::string text;
  double lowest_mm;  // lowest point below the body's position
};

class BodyTissue : public tests::SceneFile {
 protected:
  static std::string head() {
    return "format = 1\n[tool]\nradius = 5\nstiffness = 1000\n" + tests::unlimited +
           "[material.gel]\nyoung = 5000\npoisson = 0.3\n";
  }
  // A block of tissue with its upper face at z = 0.
  static std::string block() {
    return head() +
           "[[soft]]\nname = \"block\"\nformula = \"block\"\n"
           "size = [60, 60, 24]\nspacing = 2\nposition = [0, 0, -12]\nmaterial = \"gel\"\n" +
           tests::some_path;
  }
  // A body that moves straight down to `deep_mm` below first contact, sideways by `along_mm`, stops there,
  // and moves up.
  static std::string pusher(const Shape& shape, double deep_mm, double along_mm, double speed_mm_per_s,
                            double stay_s = 0.0) {
    const double above = shape.lowest_mm + 3.0, below = shape.lowest_mm - deep_mm, from = -0.5 * along_mm;
    const auto at = [](double x, double z, const std::string& more = "") {
      return "[" + std::to_string(x) + ", 0.7, " + std::to_string(z) + more + "]";
    };
    return "[[rigid]]\nname = \"pusher\"\n" + shape.text + "position = " + at(from, above) +
           "\nmotion = \"path\"\n[rigid.path]\nkind = \"waypoints\"\nspeed = " +
           std::to_string(speed_mm_per_s) + "\npoints = [" + at(from, above) + ", " + at(from, below) + ", " +
           at(-from, below, stay_s > 0.0 ? ", " + std::to_string(stay_s) : "") + ", " + at(-from, above) +
           "]\n";
  }
  std::vector<Shape> shapes() const {
    polygon::save_ply(folder_ / "ball.ply", polygon::make_ball_mesh(7e-3, 3));
    return {
        {"ball", "primitive = \"ball\"\nradius = 8\n", 8.0},
        {"small ball", "primitive = \"ball\"\nradius = 2\n", 2.0},
        {"box", "primitive = \"box\"\nsize = [14, 10, 12]\n", 6.0},
        {"turned box", "primitive = \"box\"\nsize = [14, 10, 12]\nrotation = [40, 30, 10]\n", 10.5},
        {"capsule", "primitive = \"capsule\"\nradius = 5\nlength = 20\n", 15.0},
        {"lying capsule", "primitive = \"capsule\"\nradius = 5\nlength = 20\nrotation = [90, 0, 20]\n", 5.0},
        {"mesh", "mesh = \"ball.ply\"\nunit = \"m\"\n", 7.0}};
  }
};

const voxel::SoftObject& tissue(Touch& touch) {
  return *touch.state().soft[0];
}

// Largest depth of a surface voxel's ball in a rigid object (spacings).
double deepest(Touch& touch, std::size_t rigid = 0) {
  const hybrid::BodyFrame& frame = touch.state().rigid[rigid].frame;
  const polygon::RigidSurface& surface = *touch.world().rigid[rigid].surface;
  const voxel::SoftObject& object = tissue(touch);
  const dvec3 low = surface.lower() - object.voxel_radius(), high = surface.upper() + object.voxel_radius();
  double worst = 0.0;
  for (const voxel::VoxelId v : object.lattice().surface()) {
    if (object.lattice().anchored(v)) continue;
    const dvec3 at = frame.to_body(touch.world().soft[0].to_scene(object.position(v)));
    if (glm::any(glm::lessThan(at, low)) || glm::any(glm::greaterThan(at, high))) continue;
    polygon::SignedDistance near;
    if (!polygon::signed_distance(surface, at, 0.02, dvec3(0.0), near)) continue;
    worst = std::max(worst, (object.voxel_radius() - near.distance) / object.lattice().min_spacing_m());
  }
  return worst;
}

double largest_displacement(Touch& touch) {
  double most = 0.0;
  for (const voxel::VoxelId v : tissue(touch).lattice().surface()) {
    const dvec3 u = tissue(touch).state().at(v);
    if (!tests::finite(u)) return std::numeric_limits<double>::infinity();
    most = std::max(most, glm::length(u));
  }
  return most;
}

void come_to_rest(Touch& touch, const dvec3& device) {
  for (int n = 0; n < 3000 && !tissue(touch).asleep(); ++n) touch.at(device);
  EXPECT_TRUE(tissue(touch).asleep());
}

TEST_F(BodyTissue, LeavesTheWayOfABodyAtAnySpeedAndComesBack) {
  for (const Shape& shape : shapes()) {
    for (const double speed : {100.0, 1000.0}) {
      for (const bool asynchronous : {false, true}) {
        SCOPED_TRACE(std::string(shape.name) + " at " + std::to_string(speed) + " mm/s" +
                     (asynchronous ? ", relaxed apart" : ""));
        Touch touch(load(block() + pusher(shape, 6.0, 8.0, speed)), kFarAway, asynchronous);
        double worst = 0.0, moved = 0.0;
        const int ticks = static_cast<int>((9.0 + 8.0 + 9.0) / speed * 1e3) + 20;
        for (int n = 0; n < ticks; ++n) {
          touch.at(kFarAway);
          worst = std::max(worst, deepest(touch));
          moved = std::max(moved, largest_displacement(touch));
        }
        EXPECT_LE(voxel::worst_violation(tissue(touch).lattice(), tissue(touch).state()), kLinks_m);
        come_to_rest(touch, kFarAway);
        EXPECT_LE(worst, kOverlap);
        EXPECT_GT(moved, 4e-3) << "it was pushed";
        EXPECT_LE(largest_displacement(touch), kBack_m) << "it springs back";
        EXPECT_EQ(touch.state().faults, 0U);
      }
    }
  }
}

// At 1 m/s a body moves by two spacings of this block per tick.
TEST_F(BodyTissue, LeavesTheWayOfABodyThatGoesSpacingsInATick) {
  const std::string fine = head() +
                           "[[soft]]\nname = \"block\"\nformula = \"block\"\nsize = [22.5, 22.5, 7]\n"
                           "spacing = 0.5\nposition = [0, 0, -3.5]\nmaterial = \"gel\"\n" +
                           tests::some_path;
  for (const std::size_t number : {0U, 2U}) {
    for (const bool asynchronous : {false, true}) {
      Touch touch(load(fine + pusher(shapes()[number], 1.5, 2.0, 1000.0)), kFarAway, asynchronous);
      double worst = 0.0;
      for (int n = 0; n < 60; ++n) {
        touch.at(kFarAway);
        worst = std::max(worst, deepest(touch));
      }
      EXPECT_LE(worst, kOverlap) << shapes()[number].name;
      EXPECT_EQ(touch.state().faults, 0U);
    }
  }
}

// When the body advances, the energy in the springs grows by the work of the force that the anchors carry. No
// other force acts.
TEST_F(BodyTissue, StandingInTissueABodyIsCarriedByItsAnchors) {
  for (const bool asynchronous : {false, true}) {
    std::array<double, 2> energy{}, force{};
    for (const std::size_t n : {0U, 1U}) {
      const double deep_mm = n == 0 ? 2.0 : 2.2;
      Touch touch(load(block() + pusher(shapes()[0], deep_mm, 0.0, 50.0, 60.0)), kFarAway, asynchronous);
      for (int tick = 0; tick < 200; ++tick) touch.at(kFarAway);
      come_to_rest(touch, kFarAway);
      const tests::Supports bearing = tests::supports_of(touch.world(), touch.state())[0];
      energy[n] = tissue(touch).energy_J();
      force[n] = glm::length(bearing.anchors_N);
      EXPECT_LE(glm::length(bearing.anchors_N + bearing.rigid_N), 0.01 * force[n]);
      EXPECT_LE(bearing.worst_unbalanced_N, 0.01 * force[n]);
      EXPECT_LE(deepest(touch), kOverlap);
      for (int tick = 0; tick < 100; ++tick) touch.at(kFarAway);
      EXPECT_EQ(tissue(touch).energy_J(), energy[n]) << "at rest it stays as it is";
    }
    EXPECT_GT(force[0], 0.05);
    EXPECT_NEAR((energy[1] - energy[0]) / 0.2e-3, 0.5 * (force[0] + force[1]), 0.02 * force[0]);
  }
}

TEST_F(BodyTissue, ABarSlidesAcrossTheSurface) {
  const Shape bar{"bar", "primitive = \"capsule\"\nradius = 3\nlength = 40\nrotation = [90, 0, 0]\n", 3.0};
  for (const double speed : {50.0, 300.0, 1000.0}) {
    for (const bool asynchronous : {false, true}) {
      SCOPED_TRACE(std::to_string(speed) + " mm/s" + (asynchronous ? ", relaxed apart" : ""));
      Touch touch(load(block() + pusher(bar, 3.0, 30.0, speed)), kFarAway, asynchronous);
      double worst = 0.0;
      for (int n = 0; n < static_cast<int>(42.0 / speed * 1e3) + 20; ++n) {
        touch.at(kFarAway);
        worst = std::max(worst, deepest(touch));
      }
      come_to_rest(touch, kFarAway);
      EXPECT_LE(worst, kOverlap);
      EXPECT_LE(largest_displacement(touch), kBack_m);
      EXPECT_EQ(touch.state().faults, 0U);
    }
  }
}

// The tool rests on tissue that a ball pushes from the side. From tick to tick, the proxy moves no further
// than the tissue under it.
TEST_F(BodyTissue, AToolThatRestsOnTheTissueFeelsABodyBesideIt) {
  const std::string ball =
      "[[rigid]]\nname = \"pusher\"\nprimitive = \"ball\"\nradius = 8\nposition = [45, 0, -4]\n"
      "motion = \"path\"\n[rigid.path]\nkind = \"waypoints\"\nspeed = 100\n"
      "points = [[45, 0, -4], [45, 0, -4, 0.4], [32, 0, -4, 0.2], [45, 0, -4]]\n";
  const dvec3 above(0.018, 0.0, 0.02), on(0.018, 0.0, 0.003);
  for (const bool asynchronous : {false, true}) {
    SCOPED_TRACE(asynchronous ? "relaxed apart" : "in the tick");
    Touch touch(load(block() + ball), above, asynchronous);
    tests::OverlapChecker watch(touch.world(), touch.state());
    touch.go(on, 1e-4, 0);
    while (touch.state().tick < 390) touch.at(on);
    const double alone = glm::length(tests::coupling(touch.at(on)));
    double least = alone, most = alone, jump = 0.0, worst = 0.0;
    dvec3 before = touch.state().proxy_m;
    std::vector<dvec3> places;
    for (int n = 0; n < 600; ++n) {
      places.clear();
      for (const voxel::VoxelId v : tissue(touch).lattice().surface())
        places.push_back(tissue(touch).position(v));
      const hybrid::TickResult felt = touch.at(on);
      watch.check(touch.state(), felt);
      double way = 0.0;
      for (std::size_t s = 0; s < places.size(); ++s) {
        const dvec3 now = tissue(touch).position(tissue(touch).lattice().surface()[s]);
        if (glm::distance(touch.world().soft[0].to_scene(now), felt.proxy_m) > 0.01) continue;
        way = std::max(way, glm::distance(now, places[s]));
      }
      jump = std::max(jump, glm::distance(felt.proxy_m, before) - way);
      before = felt.proxy_m;
      const double force = glm::length(tests::coupling(felt));
      least = std::min(least, force);
      most = std::max(most, force);
      worst = std::max(worst, deepest(touch));
    }
    EXPECT_GT(most - least, 0.05 * alone) << "what the body moves is felt through the tissue";
    EXPECT_LE(jump, 5e-6);
    EXPECT_LE(worst, kOverlap);
    EXPECT_LE(watch.tool_inside_m(), 5e-6);
    EXPECT_NEAR(glm::length(tests::coupling(touch.at(on))), alone, 0.05 * alone) << "and no more afterwards";
    EXPECT_EQ(touch.state().faults, 0U);
  }
}

// The body moves deeper than the links allow the tissue to be squeezed. The tissue stays out of the bone,
// overlaps the body instead, and a fault reports this.
TEST_F(BodyTissue, SqueezedOntoBoneItStaysOutOfBoneAndComesBack) {
  const std::string slab = head() +
                           "[[soft]]\nname = \"slab\"\nformula = \"block\"\n"
                           "size = [60, 40, 8]\nspacing = 2\nposition = [0, 0, -4]\nmaterial = \"gel\"\n"
                           "[soft.anchors]\nfaces = [\"-x\"]\nrigid_within = 0\n" +
                           tests::some_path;
  const std::string plate =
      "[[rigid]]\nname = \"plate\"\nprimitive = \"box\"\nsize = [80, 60, 6]\nposition = [0, 0, -12]\n";
  for (const Shape& shape : shapes()) {
    if (shape.name == std::string("small ball"))
      continue;  // it is as small as a voxel, and pushes the voxels apart
    for (const double along : {0.0, 10.0}) {
      for (const bool asynchronous : {false, true}) {
        const double speed = asynchronous ? 1000.0 : 200.0;
        SCOPED_TRACE(std::string(shape.name) + (along > 0.0 ? " drawn along" : "") +
                     (asynchronous ? ", relaxed apart" : ""));
        Touch touch(load(slab + pusher(shape, 7.0, along, speed) + plate), kFarAway, asynchronous);
        double bone = 0.0, moved = 0.0;
        for (int n = 0; n < static_cast<int>((20.0 + along) / speed * 1e3) + 300; ++n) {
          touch.at(kFarAway);
          bone = std::max(bone, deepest(touch, 1));
          moved = std::max(moved, largest_displacement(touch));
        }
        EXPECT_LE(voxel::worst_violation(tissue(touch).lattice(), tissue(touch).state()), kLinks_m);
        come_to_rest(touch, kFarAway);
        EXPECT_LE(bone, kOverlap);
        EXPECT_LT(moved, 0.1);
        EXPECT_LE(largest_displacement(touch), kBack_m);
        EXPECT_EQ(touch.state().faults, static_cast<std::uint32_t>(hybrid::fault_body_squeezed));
      }
    }
  }
}

TEST_F(BodyTissue, SqueezedByABodyThatStandsItIsCalm) {
  for (const bool asynchronous : {false, true}) {
    Touch touch(load(block() + pusher(shapes()[0], 20.0, 0.0, 200.0, 60.0)), kFarAway, asynchronous);
    for (int n = 0; n < 2500; ++n) touch.at(kFarAway);
    const auto surface = tissue(touch).lattice().surface();
    std::vector<dvec3> before;
    for (const voxel::VoxelId v : surface) before.push_back(tissue(touch).state().at(v));
    double way = 0.0;
    for (int n = 0; n < 500; ++n) {
      touch.at(kFarAway);
      for (std::size_t s = 0; s < surface.size(); ++s)
        way = std::max(way, glm::distance(before[s], tissue(touch).state().at(surface[s])));
    }
    EXPECT_LE(way, asynchronous ? 0.0 : 0.25 * kSpacing);
    EXPECT_TRUE(tissue(touch).asleep() || !asynchronous);
  }
}

TEST_F(BodyTissue, SqueezedOntoAnchorsItComesBack) {
  for (const bool asynchronous : {false, true}) {
    Touch touch(load(block() + pusher(shapes()[0], 20.0, 0.0, 200.0)), kFarAway, asynchronous);
    for (int n = 0; n < 300; ++n) {
      touch.at(kFarAway);
      ASSERT_LT(largest_displacement(touch), 0.1);
    }
    EXPECT_LE(voxel::worst_violation(tissue(touch).lattice(), tissue(touch).state()), kLinks_m);
    come_to_rest(touch, kFarAway);
    EXPECT_LE(largest_displacement(touch), kBack_m);
    EXPECT_EQ(touch.state().faults, static_cast<std::uint32_t>(hybrid::fault_body_squeezed));
  }
}

// The body meets more voxels than a tick examines. A fault reports this, and the tissue stays sound.
TEST_F(BodyTissue, ABodyThatComesToTooManyVoxelsSaysSo) {
  const std::string sheet =
      head() +
      "[[soft]]\nname = \"sheet\"\nformula = \"block\"\nsize = [50, 50, 3.2]\nspacing = 0.8\n"
      "position = [0, 0, -2]\nmaterial = \"gel\"\n" +
      tests::some_path +
      "[[rigid]]\nname = \"plate\"\nprimitive = \"box\"\nsize = [60, 60, 10]\nposition = [0, 0, 8]\n"
      "motion = \"path\"\n[rigid.path]\nkind = \"waypoints\"\nspeed = 50\n"
      "points = [[0, 0, 8], [0, 0, 4], [0, 0, 10]]\n";
  Touch touch(load(sheet), kFarAway);
  for (int n = 0; n < 250; ++n) touch.at(kFarAway);
  EXPECT_NE(touch.state().faults & hybrid::fault_body_crowded, 0U);
  EXPECT_LT(largest_displacement(touch), 0.1);
}

TEST_F(BodyTissue, ARecordedSessionReplaysToTheBit) {
  tests::expect_replays(tests::source_folder / "scenes" / "pushed-tissue.toml", 2.5);
}

TEST_F(BodyTissue, RefusesWhatIsNotSupported) {
  const auto refusal = [&](const std::string& rigid) -> std::string {
    const hybrid::Scene scene = load(block() + rigid);
    try {
      (void)hybrid::build_scene(scene);
    } catch (const std::exception& e) {
      return e.what();
    }
    return "";
  };
  const std::string sheet = refusal(
      "[[rigid]]\nname = \"b\"\nprimitive = \"plane\"\nsize = 20\nposition = [0, 0, 30]\nmotion = \"path\"\n"
      "[rigid.path]\nkind = \"waypoints\"\nspeed = 10\npoints = [[0, 0, 30], [0, 0, 20]]\n");
  EXPECT_NE(sheet.find("open sheet"), std::string::npos) << sheet;
}

// The outward direction of a primitive, from outside and from inside.
TEST(SignedDistance, SaysTheWayOutFromEitherSide) {
  const auto check = [](const polygon::RigidSurface& surface, const dvec3& from, const dvec3& way,
                        double distance) {
    polygon::SignedDistance near;
    ASSERT_TRUE(polygon::signed_distance(surface, from, 1.0, dvec3(0.0), near));
    EXPECT_NEAR(near.distance, distance, 1e-15);
    EXPECT_GT(glm::dot(near.normal, way), 0.99);
  };
  const dvec3 z(0.0, 0.0, 1.0), x(1.0, 0.0, 0.0);
  const auto ball = polygon::make_ball_surface(0.01);
  check(*ball, 0.012 * z, z, 0.002);
  check(*ball, 0.007 * z, z, -0.003);
  const auto box = polygon::make_box_surface({0.01, 0.02, 0.03});
  check(*box, {0.009, 0.0, 0.0}, x, -0.001);
  check(*box, {0.0, 0.0, 0.031}, z, 0.001);
  const auto capsule = polygon::make_capsule_surface(0.005, 0.01);
  check(*capsule, {0.004, 0.0, 0.005}, x, -0.001);
  polygon::SignedDistance near;
  // On the surface itself, the direction is that of the given previous normal.
  EXPECT_FALSE(polygon::signed_distance(*ball, 0.01 * z, 1.0, dvec3(0.0), near));
  ASSERT_TRUE(polygon::signed_distance(*ball, 0.01 * z, 1.0, x, near));
  EXPECT_EQ(near.normal, x);
  EXPECT_EQ(near.distance, 0.0);
}

}  // namespace
