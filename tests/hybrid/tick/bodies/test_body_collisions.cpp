// SPDX-License-Identifier: GPL-3.0-or-later
// Free bodies and rigid objects, against closed forms and conservation laws. Overlap is measured at points
// that the tick does not use.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>
#include <random>
#include <string>
#include <vector>

#include "hybrid/world/free_body.h"
#include "polygon/files/mesh_file.h"
#include "polygon/surface/primitives.h"
#include "polygon/surface/signed_distance.h"
#include "tests/hybrid/fixtures/touch.h"

namespace {

using glm::dvec3;
using tests::Touch;

constexpr dvec3 kFarAway(0.0, 0.0, 0.9);
constexpr double kGravity = 9.81;

const std::string kHead =
    "format = 1\n[tool]\nradius = 5\nstiffness = 1000\n" + tests::unlimited + tests::some_path;
const std::string kFalls = "gravity = [0, 0, -9.81]\n";

std::string at(const dvec3& mm) {
  return "position = [" + std::to_string(mm.x) + ", " + std::to_string(mm.y) + ", " + std::to_string(mm.z) +
         "]\n";
}
std::string rigid(const std::string& name, const std::string& shape, const dvec3& mm,
                  const std::string& more = "") {
  return "[[rigid]]\nname = \"" + name + "\"\n" + shape + at(mm) + more;
}
std::string free(const std::string& shape, const dvec3& mm, const std::string& more = kFalls) {
  return rigid("body", shape, mm, "motion = \"free\"\ndensity = 2000\n" + more);
}
std::string another(const std::string& name, const std::string& shape, const dvec3& mm,
                    const std::string& more = kFalls) {
  return rigid(name, shape, mm, "motion = \"free\"\ndensity = 2000\n" + more);
}
const std::string kBall = "primitive = \"ball\"\nradius = 8\n";
const std::string kBox = "primitive = \"box\"\nsize = [24, 16, 10]\n";
const std::string kCapsule = "primitive = \"capsule\"\nradius = 5\nlength = 20\n";
const std::string kTable =
    "primitive = \"box\"\nsize = [300, 300, 20]\n";  // its top is 10 mm above its position
const std::string kSheet = "primitive = \"plane\"\nsize = 300\n";
const std::string kThin = "primitive = \"box\"\nsize = [300, 300, 1]\n";

// Random points of the surface, denser along edges.
std::vector<dvec3> seen_points(const hybrid::RigidObject& object, std::mt19937& engine) {
  std::vector<dvec3> points;
  const polygon::TriangleMesh& mesh = *object.drawn;
  for (int n = 0; n < 3000; ++n) {
    const auto& t = mesh.triangles[engine() % mesh.triangles.size()];
    double u = tests::between(engine, 0.0, 1.0), v = tests::between(engine, 0.0, 1.0);
    if (n % 3 == 0) v = 0.0;
    if (u + v > 1.0) {
      u = 1.0 - u;
      v = 1.0 - v;
    }
    points.push_back((1.0 - u - v) * mesh.vertices[t[0]] + u * mesh.vertices[t[1]] + v * mesh.vertices[t[2]]);
  }
  return points;
}

// Depth of the objects a and b in each other (m). A sheet has no inside, so nothing is deep in it.
class Overlap {
 public:
  Overlap(Touch& touch, std::size_t a, std::size_t b) : touch_(touch), pair_{a, b} {
    std::mt19937 engine(7);
    for (int side = 0; side < 2; ++side)
      points_[side] = seen_points(touch.world().rigid[pair_[side]], engine);
  }
  double deepest() {
    double worst = 0.0;
    for (int side = 0; side < 2; ++side) {
      const polygon::RigidSurface& surface = *touch_.world().rigid[pair_[1 - side]].surface;
      const hybrid::BodyFrame &of = touch_.state().rigid[pair_[side]].frame,
                              &in = touch_.state().rigid[pair_[1 - side]].frame;
      for (const dvec3& p : points_[side]) {
        const dvec3 x = in.to_body(of.to_scene(p));
        polygon::SignedDistance near;
        if (surface.inside(x) && polygon::signed_distance(surface, x, 1.0, dvec3(0.0), near))
          worst = std::max(worst, -near.distance);
      }
    }
    return worst;
  }

 private:
  Touch& touch_;
  std::size_t pair_[2];
  std::vector<dvec3> points_[2];
};

class BodyCollisions : public tests::SceneFile {};

const hybrid::FreeBodyState& state_of(Touch& touch, std::size_t o) {
  return touch.state().rigid[o].free;
}
const hybrid::FreeBody& body_of(Touch& touch, std::size_t o) {
  return touch.world().rigid[o].motion.free_body();
}
double energy_J(Touch& touch, std::size_t o) {
  const hybrid::FreeBody& body = body_of(touch, o);
  return hybrid::kinetic_energy_J(body, state_of(touch, o)) -
         body.mass.mass_kg * glm::dot(body.gravity_m_per_s2, state_of(touch, o).centre_m);
}

TEST_F(BodyCollisions, WhatIsDroppedComesToRestOnWhatStands) {
  polygon::save_ply(folder_ / "block.ply", polygon::make_box_mesh({0.15, 0.15, 0.01}, 40));
  const std::string mesh = "mesh = \"block.ply\"\nunit = \"m\"\n";
  struct Case {
    const char* name;
    std::string shape;
    double rest_mm;  // height of its centre above the table at rest
  };
  const std::string damped = kFalls + "drag = 0.02\nangular_drag = 1e-6\n";
  const std::vector<Case> cases{{"ball", kBall, 8.0},
                                {"box", kBox, 5.0},
                                {"box on an edge", kBox + "rotation = [20, 7, 0]\n", 5.0},
                                {"capsule", kCapsule + "rotation = [80, 0, 0]\n", 5.0}};
  for (const Case& c : cases) {
    struct Table {
      const char* name;
      std::string shape;
      double top_mm;
    };
    for (const Table& table :
         {Table{"box", kTable, 10.0}, Table{"sheet", kSheet, 0.0}, Table{"mesh", mesh, 10.0}}) {
      SCOPED_TRACE(std::string(c.name) + " on a " + table.name);
      Touch touch(load(kHead + free(c.shape, {3, 2, 40}, damped) +
                       rigid("table", table.shape, {0, 0, -table.top_mm})),
                  kFarAway);
      Overlap overlap(touch, 0, 1);
      double worst = 0.0, before = energy_J(touch, 0), gained = 0.0, most_us = 0.0;
      for (int n = 0; n < 3000; ++n) {
        const hybrid::TickResult tick = touch.at(kFarAway);
        most_us = std::max(most_us, tick.tick_us);
        const double now = energy_J(touch, 0);
        gained = std::max(gained, now - before);
        before = now;
        if (n % 20 == 0) worst = std::max(worst, overlap.deepest());
      }
      std::printf(
          "%s on a %s: rests %.4f mm up, speed %.2e m/s, overlap at most %.2e mm, energy gained in a tick "
          "%.1e "
          "J, tick at most %.0f us\n",
          c.name, table.name, 1e3 * state_of(touch, 0).centre_m.z,
          glm::length(state_of(touch, 0).velocity_m_per_s), 1e3 * worst, gained, most_us);
      EXPECT_NEAR(1e3 * state_of(touch, 0).centre_m.z, c.rest_mm, 0.02);
      EXPECT_LE(worst, 1e-6);
      EXPECT_LE(glm::length(state_of(touch, 0).velocity_m_per_s), 1e-3);
      EXPECT_LE(gained, 1e-8);
      EXPECT_EQ(touch.state().faults, 0U);
    }
  }
}

// At up to 20 m/s, a body moves further per tick than its own length.
TEST_F(BodyCollisions, NothingPassesThroughAnythingAtAnySpeed) {
  polygon::save_ply(folder_ / "sphere.ply", polygon::make_ball_mesh(0.009, 3));
  const std::string mesh = "mesh = \"sphere.ply\"\nunit = \"m\"\n";
  std::mt19937 engine(3);
  double worst = 0.0;
  int cases = 0;
  for (const std::string& shape : {kBall, kBox, kCapsule, mesh}) {
    const std::string turned = shape + "rotation = [30, 50, 10]\n";
    for (const std::string& wall : {kSheet, kThin, kTable}) {
      for (const double speed : {0.1, 1.0, 5.0, 19.0}) {
        SCOPED_TRACE(shape + wall + std::to_string(speed));
        Touch touch(load(kHead + free(turned, {0, 0, 60}, "") + rigid("wall", wall, {0, 0, -10})), kFarAway);
        hybrid::FreeBodyState& body = touch.state().rigid[0].free;
        const dvec3 aim(tests::between(engine, -0.3, 0.3), tests::between(engine, -0.3, 0.3), -1.0);
        body.velocity_m_per_s = speed * glm::normalize(aim);
        body.spin_rad_per_s =
            20.0 * dvec3(tests::between(engine, -1.0, 1.0), tests::between(engine, -1.0, 1.0),
                         tests::between(engine, -1.0, 1.0));
        Overlap overlap(touch, 0, 1);
        const double had_J = energy_J(touch, 0);
        const int ticks = static_cast<int>(std::min(0.2 / speed, 0.4) * 1e3) + 20;
        for (int n = 0; n < ticks; ++n) {
          touch.at(kFarAway);
          ASSERT_GT(body.centre_m.z, wall == kTable ? 0.0 : -0.0105);
          EXPECT_LE(energy_J(touch, 0), had_J * (1.0 + 1e-9));
          worst = std::max(worst, overlap.deepest());
        }
        EXPECT_EQ(touch.state().faults, 0U);
        ++cases;
      }
    }
  }
  std::printf("%d cases: deepest overlap %.2e mm\n", cases, 1e3 * worst);
  EXPECT_LE(worst, 1e-5);
}

TEST_F(BodyCollisions, MomentumIsKeptAndNoEnergyGained) {
  std::mt19937 engine(5);
  double lost = 0.0, turned = 0.0;
  int met = 0;
  for (int run = 0; run < 24; ++run) {
    const std::string& first = run % 3 == 0 ? kBall : run % 3 == 1 ? kBox : kCapsule;
    const std::string& second = run % 2 == 0 ? kBox : kBall;
    Touch touch(load(kHead + free(first, {0, 0, 0}, "") +
                     another("other", second + "rotation = [10, 20, 30]\n",
                             {40, tests::between(engine, -8, 8), tests::between(engine, -8, 8)}, "")),
                kFarAway);
    touch.state().rigid[0].free.velocity_m_per_s = {0.8, 0, 0};
    touch.state().rigid[0].free.spin_rad_per_s = {3, -4, 5};
    const auto linear = [&] {
      return body_of(touch, 0).mass.mass_kg * state_of(touch, 0).velocity_m_per_s +
             body_of(touch, 1).mass.mass_kg * state_of(touch, 1).velocity_m_per_s;
    };
    const auto angular = [&] {
      dvec3 sum(0.0);
      for (std::size_t o = 0; o < 2; ++o) {
        sum += hybrid::angular_momentum(body_of(touch, o), state_of(touch, o)) +
               body_of(touch, o).mass.mass_kg *
                   glm::cross(state_of(touch, o).centre_m, state_of(touch, o).velocity_m_per_s);
      }
      return sum;
    };
    const dvec3 before = linear(), turning = angular();
    double had_J = energy_J(touch, 0) + energy_J(touch, 1);
    Overlap overlap(touch, 0, 1);
    double worst = 0.0;
    for (int n = 0; n < 120; ++n) {
      touch.at(kFarAway);
      const double has_J = energy_J(touch, 0) + energy_J(touch, 1);
      EXPECT_LE(has_J, had_J + 1e-9) << "run " << run << ", tick " << n;
      had_J = has_J;
      worst = std::max(worst, overlap.deepest());
    }
    if (glm::length(state_of(touch, 1).velocity_m_per_s) > 0.0) ++met;
    lost = std::max(lost, glm::length(linear() - before) / glm::length(before));
    turned = std::max(turned, glm::length(angular() - turning) / glm::length(turning));
    EXPECT_LE(worst, 3e-4) << "edges that cross";
    EXPECT_EQ(touch.state().faults, 0U);
  }
  std::printf("%d of 24 met: momentum off by %.1e of itself, angular momentum by %.1e\n", met, lost, turned);
  EXPECT_GE(met, 20);
  EXPECT_LE(lost, 1e-9);
  EXPECT_LE(turned, 0.02) << "places are put right by microns";
}

// A ball hits another one centrally and without friction. Both continue at the speed of their common centre
// of mass.
TEST_F(BodyCollisions, WhatMeetsHeadOnGoesOnTogether) {
  Touch touch(load(kHead + free(kBall, {0, 0, 0}, "") + another("other", kBall, {30, 0, 0}, "")), kFarAway);
  touch.state().rigid[0].free.velocity_m_per_s = {0.5, 0, 0};
  for (int n = 0; n < 200; ++n) touch.at(kFarAway);
  for (std::size_t o = 0; o < 2; ++o) {
    EXPECT_NEAR(state_of(touch, o).velocity_m_per_s.x, 0.25, 1e-4);
    EXPECT_NEAR(state_of(touch, o).velocity_m_per_s.y, 0.0, 1e-9);
  }
}

// A block on a slope stays if the slope's tangent is below the coefficient of friction. Otherwise it slides
// by Coulomb's law.
TEST_F(BodyCollisions, OnASlopeFrictionHoldsUpToItsCone) {
  const double friction = 0.4, degrees = glm::pi<double>() / 180.0;
  for (const double angle : {10.0, 20.0, 21.0, 23.0, 30.0, 45.0}) {
    const std::string rough = "friction = " + std::to_string(friction) + "\n";
    const std::string tilt = "rotation = [0, " + std::to_string(angle) + ", 0]\n";
    const dvec3 up(std::sin(angle * degrees), 0.0, std::cos(angle * degrees));
    const std::string block = free(kBox + tilt, 1e3 * (0.015 + 3.05e-6) * up, kFalls + rough);
    Touch touch(load(kHead + block + rigid("slope", kTable + tilt, {0, 0, 0}, rough)), kFarAway);
    const dvec3 from = state_of(touch, 0).centre_m;
    const int ticks = 150;
    for (int n = 0; n < ticks; ++n) touch.at(kFarAway);
    const double way = glm::distance(state_of(touch, 0).centre_m, from), t = 1e-3 * ticks;
    const double pull = kGravity * (std::sin(angle * degrees) - friction * std::cos(angle * degrees));
    const double expected = pull > 0.0 ? 0.5 * pull * t * t : 0.0;
    std::printf("%g degrees: %.3f mm of %.3f\n", angle, 1e3 * way, 1e3 * expected);
    EXPECT_NEAR(way, expected, 0.02 * expected + 2e-5);
    EXPECT_LE(glm::length(state_of(touch, 0).spin_rad_per_s), 0.05);
  }
}

TEST_F(BodyCollisions, ABallRollsDownASlopeAtFiveSeventhsOfSliding) {
  const double angle = 10.0, radians = angle * glm::pi<double>() / 180.0;
  const std::string rough = "friction = 0.8\n", tilt = "rotation = [0, " + std::to_string(angle) + ", 0]\n";
  const dvec3 up(std::sin(radians), 0.0, std::cos(radians));
  Touch touch(load(kHead + free(kBall, 1e3 * (0.018 + 1e-6) * up, kFalls + rough) +
                   rigid("slope", kTable + tilt, {0, 0, 0}, rough)),
              kFarAway);
  const dvec3 from = state_of(touch, 0).centre_m;
  for (int n = 0; n < 300; ++n) touch.at(kFarAway);
  const double expected = 0.5 * 5.0 / 7.0 * kGravity * std::sin(radians) * 0.09;
  EXPECT_NEAR(glm::distance(state_of(touch, 0).centre_m, from), expected, 0.02 * expected);
}

TEST_F(BodyCollisions, ABeltTakesAlongWhatLiesOnIt) {
  const std::string rough = "friction = 0.5\n";
  Touch touch(load(kHead + free(kBox, {0, 0, 5.00305}, kFalls + rough) +
                   rigid("belt", kTable, {0, 0, -10},
                         rough + "motion = \"path\"\n[rigid.path]\nkind = \"waypoints\"\nspeed = 100\n"
                                 "points = [[0, 0, -10], [100, 0, -10]]\n")),
              kFarAway);
  // The block slides for v / (mu g), until it has the speed of the belt.
  const double slides_s = 0.1 / (0.5 * kGravity);
  for (int n = 0; n < 500; ++n) touch.at(kFarAway);
  EXPECT_NEAR(state_of(touch, 0).velocity_m_per_s.x, 0.1, 1e-4);
  const double behind = 0.1 * slides_s / 2.0;
  EXPECT_NEAR(state_of(touch, 0).centre_m.x, 0.1 * 0.5 - behind, 2e-4);
}

TEST_F(BodyCollisions, AStackStands) {
  std::string text = kHead + rigid("table", kTable, {0, 0, -10}, "friction = 0.5\n");
  for (int n = 0; n < 6; ++n)
    text += another("box" + std::to_string(n), kBox, {0.3 * n, 0.2 * n, 5.0 + 10.2 * n},
                    kFalls + "friction = 0.5\n");
  Touch touch(load(text), kFarAway);
  std::vector<double> us;
  us.reserve(3000);
  for (int n = 0; n < 3000; ++n) us.push_back(touch.at(kFarAway).tick_us);
  std::sort(us.begin(), us.end());
  for (std::size_t o = 1; o <= 6; ++o) {
    std::printf("box %zu: z %.4f mm, speed %.1e m/s\n", o, 1e3 * state_of(touch, o).centre_m.z,
                glm::length(state_of(touch, o).velocity_m_per_s));
    EXPECT_NEAR(1e3 * state_of(touch, o).centre_m.z, 5.0 + 10.0 * static_cast<double>(o - 1), 0.1);
    EXPECT_LE(glm::length(state_of(touch, o).velocity_m_per_s), 1e-3);
  }
  std::printf("six boxes: tick p50 %.0f, p99 %.0f, max %.0f us\n", us[us.size() / 2],
              us[us.size() * 99 / 100], us.back());
  EXPECT_EQ(touch.state().faults, 0U);
}

// A body on a path keeps its motion. A free body that has no space left between two others is not thrown out.
TEST_F(BodyCollisions, SqueezedBetweenTwoItIsAFaultAndStaysFinite) {
  const std::string piston =
      "motion = \"path\"\n[rigid.path]\nkind = \"waypoints\"\nspeed = 20\npoints = [[0, 0, 40], [0, 0, "
      "16]]\n";
  for (const std::string& shape : {kBall, kBox + "rotation = [5, 9, 0]\n", kCapsule}) {
    Touch touch(load(kHead + free(shape, {0, 0, 11}, "") + rigid("anvil", kTable, {0, 0, -10}) +
                     rigid("piston", kTable, {0, 0, 40}, piston)),
                kFarAway);
    double fastest = 0.0;
    for (int n = 0; n < 2500; ++n) {
      touch.at(kFarAway);
      ASSERT_TRUE(tests::finite(state_of(touch, 0).centre_m));
      fastest = std::max(fastest, glm::length(state_of(touch, 0).velocity_m_per_s));
    }
    std::printf("squeezed: fastest %.3f m/s\n", fastest);
    EXPECT_LE(fastest, 0.5);
    EXPECT_NE(touch.state().faults & hybrid::fault_bodies_overlap, 0U);
  }
}

// The tool pushes a puck against a wall, and the hand feels the wall.
TEST_F(BodyCollisions, TheToolFeelsTheWallThroughABody) {
  Touch touch(load(kHead + free("primitive = \"box\"\nsize = [20, 20, 20]\n", {0, 0, 10.01}) +
                   rigid("table", kTable, {0, 0, -10}) +
                   rigid("wall", "primitive = \"box\"\nsize = [20, 200, 60]\n", {40, 0, 30})),
              {-0.05, 0.0, 0.01});
  const hybrid::TickResult pressed = touch.go({0.02, 0.0, 0.01}, 1e-4, 500);
  EXPECT_NEAR(touch.state().rigid[0].pose.position_m.x, 0.02, 2e-5);
  EXPECT_NEAR(pressed.force_N.x, -1000.0 * (0.02 + 0.005 - 0.01), 0.05);
  EXPECT_EQ(touch.state().faults, 0U);
}

// Tests knobbly meshes, crossed rods, and a box on a mesh. The overlap is at most the depth that fits between
// the sample points.
TEST_F(BodyCollisions, OfMeshesAndEdgesOnlyWhatLiesBetweenPointsOverlaps) {
  polygon::TriangleMesh knobs = polygon::make_ball_mesh(0.02, 4);
  for (dvec3& v : knobs.vertices)
    v *= 1.0 + 0.1 * std::sin(300.0 * v.x) * std::sin(250.0 * v.y + 1.0) * std::cos(280.0 * v.z);
  polygon::save_ply(folder_ / "knobs.ply", knobs);
  const std::string mesh = "mesh = \"knobs.ply\"\nunit = \"m\"\n";
  const std::string rod = "primitive = \"box\"\nsize = [60, 6, 6]\n";
  struct Case {
    const char* name;
    std::string first, second;
    double most_m;
  };
  const std::vector<Case> cases{
      {"mesh on mesh", mesh, mesh + "rotation = [40, 10, 70]\n", 0.6e-3},
      {"rod across rod", rod + "rotation = [45, 0, 0]\n", rod + "rotation = [45, 0, 90]\n", 0.2e-3},
      {"box on mesh", kBox + "rotation = [30, 20, 0]\n", mesh, 0.2e-3}};
  for (const Case& c : cases) {
    Touch touch(load(kHead + free(c.first, {2, 3, 50}) + rigid("under", c.second, {0, 0, 0})), kFarAway);
    Overlap overlap(touch, 0, 1);
    double worst = 0.0, most_us = 0.0, before = energy_J(touch, 0), gained = 0.0;
    std::vector<double> us;
    us.reserve(400);
    for (int n = 0; n < 400; ++n) {
      us.push_back(touch.at(kFarAway).tick_us);
      worst = std::max(worst, overlap.deepest());
      gained = std::max(gained, energy_J(touch, 0) - before);
      before = energy_J(touch, 0);
    }
    std::sort(us.begin(), us.end());
    most_us = us.back();
    std::printf(
        "%s: overlap at most %.3f mm, energy gained in a tick %.1e J, tick p50 %.0f, p99 %.0f, max %.0f us\n",
        c.name, 1e3 * worst, gained, us[us.size() / 2], us[us.size() * 99 / 100], most_us);
    EXPECT_LE(worst, c.most_m);
    EXPECT_LE(gained, 1e-7) << "lifted out of one another";
    EXPECT_EQ(touch.state().faults, 0U);
  }
}

// A ball falls past tissue onto bone, and rests there.
TEST_F(BodyCollisions, BesideTissueBoneStopsIt) {
  Touch touch(
      load(kHead + free(kBall, {0, 0, 30}) + rigid("bone", kTable, {0, 0, -10}) +
           "[material.gel]\nyoung = 5000\npoisson = 0.3\n[[soft]]\nname = \"wall\"\nformula = \"block\"\n"
           "size = [20, 40, 20]\nspacing = 2\nposition = [17, 0, 10]\nmaterial = \"gel\"\n"),
      kFarAway);
  Overlap overlap(touch, 0, 1);
  double worst = 0.0;
  for (int n = 0; n < 2500; ++n) {
    touch.at(kFarAway);
    worst = std::max(worst, overlap.deepest());
  }
  // At rest the ball's centre is its radius of 8 mm above the bone.
  EXPECT_NEAR(state_of(touch, 0).centre_m.z, 0.008, 2e-5);
  EXPECT_EQ(worst, 0.0);
  EXPECT_EQ(touch.state().faults, 0U);
}

TEST_F(BodyCollisions, WhatBeginsInAnotherComesOutOfItSlowlyAndIsSaid) {
  Touch touch(load(kHead + free(kBox, {0, 0, 4.0}) + rigid("table", kTable, {0, 0, -10})), kFarAway);
  const auto said =
      std::any_of(touch.built.notes.begin(), touch.built.notes.end(), [](const hybrid::BuildNote& note) {
        return note.object == "body" && note.text.find("1 mm deep in \"table\"") != std::string::npos;
      });
  EXPECT_TRUE(said);
  double fastest = 0.0;
  for (int n = 0; n < 1500; ++n) {
    touch.at(kFarAway);
    fastest = std::max(fastest, glm::length(state_of(touch, 0).velocity_m_per_s));
  }
  EXPECT_NEAR(state_of(touch, 0).centre_m.z, 0.005, 2e-5);
  EXPECT_LE(fastest, 0.02);
}

}  // namespace
