// SPDX-License-Identifier: GPL-3.0-or-later
// Free bodies beside tissue: they are carried, stopped and thrown back by it, and nothing overlaps.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "tests/hybrid/fixtures/overlap_checker.h"
#include "hybrid/world/free_body.h"
#include "polygon/files/mesh_file.h"
#include "polygon/surface/primitives.h"
#include "polygon/surface/signed_distance.h"
#include "tests/hybrid/fixtures/touch.h"
#include "voxel/chain/chainmail.h"

namespace {

using glm::dvec3;
using tests::Touch;

constexpr dvec3 kFarAway(0.0, 0.0, 0.2);
constexpr dvec3 kAside(0.2, 0.2, 0.02);
constexpr double kSpacing = 2e-3;
constexpr double kOverlap = 0.05;  // of the spacing
constexpr double kLinks_m = 1e-8;

const voxel::SoftObject& tissue(Touch& touch) {
  return *touch.state().soft[0];
}

double deepest(Touch& touch, std::size_t rigid = 0) {
  const hybrid::BodyFrame& frame = touch.state().rigid[rigid].frame;
  const polygon::RigidSurface& surface = *touch.world().rigid[rigid].surface;
  const voxel::SoftObject& object = tissue(touch);
  const dvec3 low = surface.lower() - object.voxel_radius(), high = surface.upper() + object.voxel_radius();
  double worst = 0.0;
  for (const voxel::VoxelId v : object.lattice().surface()) {
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

const hybrid::FreeBodyState& free_body(Touch& touch) {
  return touch.state().rigid[0].free;
}

// Of the body, without the tissue's.
double energy_J(Touch& touch) {
  const hybrid::FreeBody& body = touch.world().rigid[0].motion.free_body();
  return hybrid::kinetic_energy_J(body, free_body(touch)) -
         body.mass.mass_kg * glm::dot(body.gravity_m_per_s2, free_body(touch).centre_m);
}

double carried_N(Touch& touch) {
  return -tests::bearings(touch.world(), touch.state())[0].anchors_N.z;
}

const std::string kBall = "primitive = \"ball\"\nradius = 8\n";
const std::string kBox = "primitive = \"box\"\nsize = [14, 10, 12]\nrotation = [20, 10, 0]\n";

class FreeOnTissue : public tests::SceneFile {
 protected:
  static std::string head(double young_Pa) {
    return "format = 1\n[tool]\nradius = 5\nstiffness = 1000\n" + tests::unlimited +
           "[material.gel]\nyoung = " + std::to_string(young_Pa) + "\npoisson = 0.3\n" + tests::some_path;
  }
  // Its upper face is at z = 0.
  static std::string block(double young_Pa) {
    return head(young_Pa) +
           "[[soft]]\nname = \"block\"\nformula = \"block\"\n"
           "size = [60, 60, 24]\nspacing = 2\nposition = [0, 0, -12]\nmaterial = \"gel\"\n";
  }
  static std::string body(const std::string& shape, double mass_kg, double z_mm, bool gravity,
                          const std::string& more = "", double x_mm = 0.3) {
    return "[[rigid]]\nname = \"body\"\n" + shape + "position = [" + std::to_string(x_mm) + ", 0.7, " +
           std::to_string(z_mm) + "]\nmotion = \"free\"\nmass = " + std::to_string(mass_kg) + "\n" +
           (gravity ? "gravity = [0, 0, -9.81]\n" : "") + more;
  }
  // A body on a path, from above to that place, where it stays.
  static std::string pushed_to(const dvec3& place_mm, const std::string& shape = kBall,
                               double from_mm = 9.0) {
    const auto at = [&](double z) {
      return std::to_string(place_mm.x) + ", " + std::to_string(place_mm.y) + ", " + std::to_string(z);
    };
    return "[[rigid]]\nname = \"body\"\n" + shape + "position = [" + at(from_mm) +
           "]\nmotion = \"path\"\n[rigid.path]\nkind = \"waypoints\"\nspeed = 50\npoints = [[" + at(from_mm) +
           "], [" + at(place_mm.z) + ", 60]]\n";
  }
};

// Dropped by a millimeter. Where it came to rest, a ball on a path is carried just so.
TEST_F(FreeOnTissue, ABallComesToRestAndItsWeightIsCarried) {
  const double weight = 0.02 * 9.81;
  for (const bool apart : {false, true}) {
    SCOPED_TRACE(apart ? "relaxed apart" : "in the tick");
    Touch touch(load(block(2e4) + body(kBall, 0.02, 9.0, true)), kFarAway, apart);
    double worst = 0.0;
    for (int n = 0; n < 4000 && (n < 100 || !tissue(touch).asleep()); ++n) {
      touch.at(kFarAway);
      worst = std::max(worst, deepest(touch));
    }
    EXPECT_TRUE(tissue(touch).asleep());
    EXPECT_EQ(free_body(touch).velocity_m_per_s, dvec3(0.0));
    EXPECT_NEAR(carried_N(touch), weight, 0.01 * weight);
    EXPECT_LE(worst, kOverlap);
    const dvec3 rest = touch.state().rigid[0].pose.position_m;
    for (int n = 0; n < 200; ++n) touch.at(kFarAway);
    EXPECT_EQ(touch.state().rigid[0].pose.position_m, rest) << "it stays there";
    EXPECT_EQ(touch.state().faults, 0U);
    Touch pushed(load(block(2e4) + pushed_to(1e3 * rest)), kFarAway, apart);
    for (int n = 0; n < 3000 && (n < 200 || !tissue(pushed).asleep()); ++n) pushed.at(kFarAway);
    EXPECT_NEAR(carried_N(pushed), weight, 0.01 * weight);
  }
}

// So deep that links are at their limits; springs across the layer of anchors carry all, since none is there.
TEST_F(FreeOnTissue, OnTightLinksABodyComesToRestAndItsWeightIsCarried) {
  struct Case {
    std::string name, shape;
    double mass_kg, young_Pa;
  };
  const std::string box = "primitive = \"box\"\nsize = [14, 10, 12]\n";
  for (const Case& c :
       {Case{"ball", kBall, 0.05, 5e3}, Case{"light ball", kBall, 0.02, 2e3}, Case{"box", kBox, 0.05, 5e3},
        Case{"box flat", box, 0.05, 5e3}, Case{"box on edge", box + "rotation = [45, 0, 0]\n", 0.05, 5e3},
        Case{"box on corner", box + "rotation = [40, 30, 10]\n", 0.05, 5e3}}) {
    for (const bool apart : {false, true}) {
      SCOPED_TRACE(c.name + (apart ? ", relaxed apart" : ", in the tick"));
      Touch touch(load(block(c.young_Pa) + body(c.shape, c.mass_kg, 9.0, true)), kFarAway, apart);
      const double weight = 9.81 * c.mass_kg;
      double fastest = 0.0, worst = 0.0;
      for (int n = 0; n < 4100; ++n) {
        touch.at(kFarAway);
        worst = std::max(worst, deepest(touch));
        if (n >= 4000) fastest = std::max(fastest, glm::length(free_body(touch).velocity_m_per_s));
      }
      EXPECT_GT(tests::bearings(touch.world(), touch.state())[0].tight, 20U);
      EXPECT_LT(fastest, 1e-4);
      EXPECT_NEAR(carried_N(touch), weight, 0.01 * weight);
      EXPECT_LE(worst, kOverlap);
      EXPECT_EQ(touch.state().faults, 0U);
      if (c.shape != kBall) continue;
      // Held at the same place by its path it is carried no less, and no more.
      const dvec3 rest_mm = 1e3 * touch.state().rigid[0].pose.position_m;
      Touch held(load(block(c.young_Pa) + pushed_to(rest_mm)), kFarAway, apart);
      double worst_held = 0.0;
      for (int n = 0; n < 1500; ++n) {
        held.at(kFarAway);
        worst_held = std::max(worst_held, deepest(held));
      }
      EXPECT_NEAR(carried_N(held), weight, 0.01 * weight);
      EXPECT_LE(worst_held, kOverlap);
    }
  }
}

// Two that share what is between them, on links at their limits: each presses with its own part of it.
TEST_F(FreeOnTissue, TwoBodiesInOneObjectComeToRestAndAreBothCarried) {
  const std::string box = "primitive = \"box\"\nsize = [14, 10, 12]\n";
  struct Case {
    std::string shape;  // of the second
    double mass_kg, x_mm;
  };
  for (const Case& c : {Case{kBall, 0.02, 14.0}, Case{box, 0.05, 14.0}}) {
    for (const bool apart : {false, true}) {
      SCOPED_TRACE(std::to_string(c.mass_kg) + " kg at " + std::to_string(c.x_mm) +
                   (apart ? ", relaxed apart" : ", in the tick"));
      std::string second = body(c.shape, c.mass_kg, 9.0, true, "", c.x_mm);
      second.replace(second.find("\"body\""), 6, "\"second\"");
      Touch touch(load(block(5e3) + body(kBall, 0.05, 9.0, true, "", -c.x_mm) + second), kFarAway, apart);
      const double weight = 9.81 * (0.05 + c.mass_kg);
      double fastest = 0.0, worst = 0.0;
      for (int n = 0; n < 3600; ++n) {
        touch.at(kFarAway);
        if (n % 8 == 0) worst = std::max({worst, deepest(touch, 0), deepest(touch, 1)});
        for (const std::size_t b : {0U, 1U}) {
          const double speed = glm::length(touch.state().rigid[b].free.velocity_m_per_s);
          if (n >= 3500) fastest = std::max(fastest, speed);
        }
      }
      EXPECT_GT(tests::bearings(touch.world(), touch.state())[0].tight, 20U);
      EXPECT_LT(fastest, 1e-4);
      EXPECT_NEAR(carried_N(touch), weight, 0.01 * weight);
      EXPECT_LE(worst, kOverlap);
      EXPECT_EQ(touch.state().faults, 0U);
    }
  }
}

// What it presses with is the slope of what the springs store, and is so wherever tissue is relaxed. (Not
// what the same box weighs that came to rest there by itself: as it turned, other voxels came to lie beside
// it.)
TEST_F(FreeOnTissue, OnTightLinksABodyThatIsHeldIsCarriedByWhatItsWayTakes) {
  struct Case {
    std::string name, shape;
    double z_mm;
  };
  const std::string box = "primitive = \"box\"\nsize = [14, 10, 12]\n";
  constexpr double kWay_mm = 0.1;
  for (const Case& c :
       {Case{"ball", kBall, 1.0}, Case{"ball", kBall, -1.0}, Case{"box flat", box, 1.0},
        Case{"box on edge", box + "rotation = [45, 0, 0]\n", 1.0},
        Case{"box on corner", box + "rotation = [40, 30, 10]\n", -1.0},
        Case{"capsule", "primitive = \"capsule\"\nradius = 4\nlength = 20\nrotation = [90, 0, 20]\n",
             -1.0}}) {
    std::array<double, 2> energy_J{}, carried{};  // a little further in the second
    double apart_N = 0.0;
    for (const int n : {0, 1, 2}) {
      SCOPED_TRACE(c.name + (n == 2 ? ", relaxed apart" : ", in the tick"));
      const double z_mm = n == 1 ? c.z_mm - kWay_mm : c.z_mm;
      Touch touch(load(block(5e3) + pushed_to({0.3, 0.7, z_mm}, c.shape, 13.0)), kFarAway, n == 2);
      double worst = 0.0;
      for (int tick = 0; tick < 2000 && (tick < 400 || !tissue(touch).asleep()); ++tick) {
        touch.at(kFarAway);
        if (tick % 8 == 0) worst = std::max(worst, deepest(touch));
      }
      EXPECT_GT(tests::bearings(touch.world(), touch.state())[0].tight, 20U);
      EXPECT_LE(worst, kOverlap);
      EXPECT_EQ(touch.state().faults, 0U);
      if (n == 2) {
        apart_N = carried_N(touch);
      } else {
        energy_J[static_cast<std::size_t>(n)] = tissue(touch).energy_J();
        carried[static_cast<std::size_t>(n)] = carried_N(touch);
      }
    }
    SCOPED_TRACE(c.name);
    EXPECT_NEAR((energy_J[1] - energy_J[0]) / (1e-3 * kWay_mm), 0.5 * (carried[0] + carried[1]),
                0.01 * carried[0]);
    EXPECT_NEAR(apart_N, carried[0], 0.01 * carried[0]);
  }
}

// Anchors carry it through links at their limits, of which springs say nothing. But it comes to rest there
// (wherever it first meets the lattice), and hardly anything lifts it on its way.
TEST_F(FreeOnTissue, SoHeavyThatItSqueezesItOntoItsAnchorsABallComesToRest) {
  struct Case {
    double mass_kg, young_Pa, x_mm;
  };
  for (const Case& c : {Case{10.0, 1e3, 0.3}, Case{10.0, 1e3, 1.1}, Case{3.0, 1e3, 1.1}, Case{0.3, 2e3, 0.3},
                        Case{30.0, 1e4, 0.3}}) {
    for (const bool apart : {false, true}) {
      SCOPED_TRACE(std::to_string(c.mass_kg) + " kg on " + std::to_string(c.young_Pa) + " Pa" +
                   (apart ? ", relaxed apart" : ", in the tick"));
      Touch touch(load(block(c.young_Pa) + body(kBall, c.mass_kg, 9.0, true, "", c.x_mm)), kFarAway, apart);
      const double begun = energy_J(touch);
      double worst = 0.0, before = begun, lifted = 0.0;
      for (int n = 0; n < 1500; ++n) {
        touch.at(kFarAway);
        worst = std::max(worst, deepest(touch));
        lifted += std::max(0.0, energy_J(touch) - before);
        before = energy_J(touch);
      }
      EXPECT_EQ(free_body(touch).velocity_m_per_s, dvec3(0.0));
      EXPECT_LE(worst, kOverlap);
      EXPECT_LE(lifted, 1e-3 * (begun - energy_J(touch)));
      EXPECT_LT(touch.state().rigid[0].pose.position_m.z, -5e-3);
      const dvec3 rest = touch.state().rigid[0].pose.position_m;
      for (int n = 0; n < 500; ++n) touch.at(kFarAway);
      EXPECT_EQ(touch.state().rigid[0].pose.position_m, rest) << "it stays there";
      EXPECT_EQ(touch.state().faults, 0U);
    }
  }
}

// Between two results tissue that is relaxed apart is a spring, and no hop may live on that.
TEST_F(FreeOnTissue, ADroppedWeightComesToRest) {
  for (const bool apart : {false, true}) {
    SCOPED_TRACE(apart ? "relaxed apart" : "in the tick");
    Touch touch(hybrid::load_scene(tests::source_folder / "scenes/dropped-weight.toml"), kFarAway, apart);
    const double weight = 9.81 * touch.world().rigid[0].motion.free_body().mass.mass_kg;
    for (int n = 0; n < 1000; ++n) touch.at(kFarAway);
    double fastest = 0.0;
    for (int n = 0; n < 200; ++n) {
      touch.at(kFarAway);
      fastest = std::max(fastest, std::abs(free_body(touch).velocity_m_per_s.z));  // over tissue it slides
    }
    EXPECT_LT(fastest, 1e-3);
    EXPECT_NEAR(carried_N(touch), weight, 0.02 * weight);
  }
}

// What tissue gives back is less than it took: the energy is that of the body alone.
TEST_F(FreeOnTissue, ThrownAtItABodyNeitherOverlapsNorGainsEnergy) {
  for (const std::string& shape : {kBall, kBox}) {
    for (const double mass : {1e-3, 0.1, 10.0}) {
      for (const double young : {1e3, 3e4, 1e6}) {
        for (const int variant : {0, 1, 2, 3}) {
          const bool gravity = (variant & 1) != 0, apart = (variant & 2) != 0;
          SCOPED_TRACE(std::string(shape == kBall ? "ball" : "box") + " of " + std::to_string(mass) +
                       " kg on " + std::to_string(young) + " Pa" + (gravity ? ", falling" : "") +
                       (apart ? ", relaxed apart" : ""));
          Touch touch(load(block(young) + body(shape, mass, 9.5, gravity)), kAside, apart);
          touch.state().rigid[0].free.velocity_m_per_s = {0.1, 0.0, -1.0};
          const double before = energy_J(touch), thrown = 0.5 * mass * 1.01;
          double worst = 0.0, gained = -thrown;
          for (int n = 0; n < 400; ++n) {
            touch.at(kAside);
            worst = std::max(worst, deepest(touch));
            gained = std::max(gained, energy_J(touch) - before);
          }
          EXPECT_LE(worst, kOverlap);
          EXPECT_LE(gained, 1e-12 * thrown);
          EXPECT_LT(largest_displacement(touch), 0.1);
          EXPECT_LE(voxel::worst_violation(tissue(touch).lattice(), tissue(touch).state()), kLinks_m);
          EXPECT_EQ(touch.state().faults, 0U);
        }
      }
    }
  }
}

TEST_F(FreeOnTissue, NorDoesAnyOtherBodyThatSpins) {
  polygon::save_ply(folder_ / "ball.ply", polygon::make_ball_mesh(7e-3, 3));
  const std::vector<std::string> shapes{
      "primitive = \"ball\"\nradius = 3\n",
      "primitive = \"capsule\"\nradius = 5\nlength = 20\n",
      "primitive = \"capsule\"\nradius = 4\nlength = 20\nrotation = [90, 0, 20]\n",
      "mesh = \"ball.ply\"\nunit = \"m\"\n",
      "primitive = \"box\"\nsize = [20, 20, 4]\nrotation = [30, 10, 0]\n",
      "primitive = \"box\"\nsize = [30, 3, 8]\nrotation = [0, 40, 10]\n"};
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> one(-1.0, 1.0);
  for (std::size_t n = 0; n < 4 * shapes.size(); ++n) {
    const double mass = std::pow(10.0, -1.0 + 2.0 * one(random)),
                 young = std::pow(10.0, 4.5 + 1.5 * one(random)), speed = n % 2 == 0 ? 1.0 : 3.0;
    const bool gravity = one(random) > 0.0, apart = one(random) > 0.0;
    SCOPED_TRACE("case " + std::to_string(n));
    Touch touch(load(block(young) + body(shapes[n % shapes.size()], mass, 16.0, gravity)), kAside, apart);
    hybrid::FreeBodyState& free = touch.state().rigid[0].free;
    free.velocity_m_per_s = {0.3 * speed * one(random), 0.3 * speed * one(random), -speed};
    free.spin_rad_per_s = 60.0 * dvec3(one(random), one(random), one(random));
    const double before = energy_J(touch),
                 thrown = hybrid::kinetic_energy_J(touch.world().rigid[0].motion.free_body(), free);
    double worst = 0.0, gained = -thrown;
    for (int tick = 0; tick < 300; ++tick) {
      touch.at(kAside);
      worst = std::max(worst, deepest(touch));
      gained = std::max(gained, energy_J(touch) - before);
    }
    EXPECT_LE(worst, kOverlap);
    EXPECT_LE(gained, 1e-9 * thrown);
    EXPECT_LT(largest_displacement(touch), 0.1);
    EXPECT_EQ(touch.state().faults, 0U);
  }
}

TEST_F(FreeOnTissue, LeavingItABodyIsNotHeldBackAndTheTissueComesBack) {
  for (const bool apart : {false, true}) {
    Touch touch(load(block(1e4) + body(kBall, 0.01, 8.5, false)), kAside, apart);
    touch.state().rigid[0].free.velocity_m_per_s = {0.0, 0.0, -0.2};
    double pulled = 0.0, deep = 0.0, most = -1.0;
    for (int n = 0; n < 3000; ++n) {
      const double before = free_body(touch).velocity_m_per_s.z;
      touch.at(kAside);
      pulled = std::max(pulled, before - free_body(touch).velocity_m_per_s.z);
      deep = std::max(deep, largest_displacement(touch));
      most = std::max(most, free_body(touch).velocity_m_per_s.z);
    }
    EXPECT_LE(pulled, 1e-9) << "tissue only pushes";
    EXPECT_GT(free_body(touch).velocity_m_per_s.z, 0.01);
    EXPECT_LE(most, 0.2);
    EXPECT_GT(deep, 1e-3);
    EXPECT_TRUE(tissue(touch).asleep());
    EXPECT_LE(largest_displacement(touch), 1e-3 * kSpacing);
    EXPECT_EQ(touch.state().faults, 0U);
  }
}

TEST_F(FreeOnTissue, HeldStillByTheToolHandAndAnchorsBalance) {
  const double weight = 0.02 * 9.81;
  for (const bool apart : {false, true}) {
    const std::string lying =
        "[[rigid]]\nname = \"body\"\nprimitive = \"box\"\nsize = [16, 16, 10]\n"
        "position = [0, 0, 5]\nfriction = 0.8\nmotion = \"free\"\nmass = 0.02\n"
        "gravity = [0, 0, -9.81]\n";
    Touch touch(load(block(2e4) + lying), {0.0, 0.0, 25e-3}, apart);
    tests::ArbitrationWatch watch(touch.world(), touch.state());
    hybrid::TickResult felt;
    double worst = 0.0;
    for (int n = 0; n < 3000; ++n) {
      const double z = std::max(25e-3 - 0.02e-3 * n, 13e-3);
      felt = touch.at({0.0, 0.0, z});
      watch.see(touch.state(), felt);
      worst = std::max(worst, deepest(touch));
    }
    const double hand = tests::coupling(felt).z;
    EXPECT_GT(hand, 0.1);
    EXPECT_NEAR(hand + weight, carried_N(touch), 0.01 * carried_N(touch));
    EXPECT_LE(worst, kOverlap);
    EXPECT_LE(watch.tool_inside_m(), 5e-6);
  }
}

// A slab held at its side over a plate, the body on it, and the tool on that: so far down that the slab's
// links are at their limits.
TEST_F(FreeOnTissue, SqueezedBetweenToolTissueAndBoneItStaysOutOfBoth) {
  const std::string slab =
      head(5e3) +
      "[[soft]]\nname = \"slab\"\nformula = \"block\"\nsize = [60, 40, 8]\nspacing = 2\n"
      "position = [0, 0, -4]\nmaterial = \"gel\"\n[soft.anchors]\nfaces = [\"-x\"]\nrigid_within = 0\n";
  const std::string plate =
      "[[rigid]]\nname = \"plate\"\nprimitive = \"box\"\nsize = [80, 60, 6]\nposition = [0, 0, -12]\n";
  for (const std::string& shape : {kBall, kBox}) {
    for (const bool apart : {false, true}) {
      SCOPED_TRACE(std::string(shape == kBall ? "ball" : "box") + (apart ? ", relaxed apart" : ""));
      std::string scene = slab;
      scene += body(shape, 0.02, 8.6, false, "drag = 0.5\nangular_drag = 1e-4\n");
      scene += plate;
      Touch touch(load(scene), {0.3e-3, 0.7e-3, 30e-3}, apart);
      double bone = 0.0, overlap = 0.0, moved = 0.0;
      for (int n = 0; n < 1500; ++n) {
        const double z = n < 1000 ? std::max(30e-3 - 0.05e-3 * n, 0.0) : std::min(0.1e-3 * (n - 1000), 40e-3);
        touch.at({0.3e-3, 0.7e-3, z});
        bone = std::max(bone, deepest(touch, 1));
        overlap = std::max(overlap, deepest(touch));
        moved = std::max(moved, largest_displacement(touch));
      }
      EXPECT_LE(bone, kOverlap);
      EXPECT_LE(overlap, kOverlap);
      EXPECT_LT(moved, 0.1);
      EXPECT_TRUE(tests::finite(free_body(touch).centre_m));
    }
  }
}

TEST_F(FreeOnTissue, ABodyThatMeetsNoTissueMovesAsWithoutIt) {
  const std::string far = "[[rigid]]\nname = \"body\"\n" + kBox +
                          "position = [0, 0, 80]\nmotion = \"free\"\nmass = 0.02\ndrag = 0.01\n";
  Touch alone(load(head(5e3) + far), kFarAway), beside(load(block(5e3) + far), kFarAway);
  for (Touch* touch : {&alone, &beside}) {
    touch->state().rigid[0].free.velocity_m_per_s = {0.1, 0.2, 0.05};
    touch->state().rigid[0].free.spin_rad_per_s = {1.0, 2.0, 3.0};
    for (int n = 0; n < 500; ++n) touch->at(kFarAway);
  }
  EXPECT_EQ(free_body(alone).centre_m, free_body(beside).centre_m);
  EXPECT_EQ(free_body(alone).rotation, free_body(beside).rotation);
}

TEST_F(FreeOnTissue, ARecordedSessionReplaysToTheBit) {
  tests::expect_replays(tests::source_folder / "scenes" / "dropped-weight.toml", 3.0);
}

}  // namespace
