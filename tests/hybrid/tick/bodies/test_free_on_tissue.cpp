// SPDX-License-Identifier: GPL-3.0-or-later
// Free bodies beside tissue. The tissue carries, stops and reflects them, and nothing overlaps.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <string>

#include "tests/hybrid/fixtures/free_on_tissue.h"
#include "tests/hybrid/fixtures/overlap_checker.h"
#include "tests/hybrid/fixtures/touch.h"

namespace {

using glm::dvec3;
using tests::Touch;
using namespace tests::free_on_tissue;  // NOLINT(google-build-using-namespace): these tests use the whole
                                        // fixture

// The ball is dropped from a height of 1 mm. A ball that is moved to the same place on a path must be carried
// equally.
TEST_F(FreeOnTissue, ABallComesToRestAndItsWeightIsCarried) {
  const double weight = 0.02 * 9.81;
  for (const bool asynchronous : {false, true}) {
    SCOPED_TRACE(asynchronous ? "relaxed apart" : "in the tick");
    Touch touch(load(block(2e4) + body(kBall, 0.02, 9.0, true)), kFarAway, asynchronous);
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
    Touch pushed(load(block(2e4) + pushed_to(1e3 * rest)), kFarAway, asynchronous);
    for (int n = 0; n < 3000 && (n < 200 || !tissue(pushed).asleep()); ++n) pushed.at(kFarAway);
    EXPECT_NEAR(carried_N(pushed), weight, 0.01 * weight);
  }
}

// The body lies so deep that links are at their limits. No link at the anchors is at its limit, so the
// springs there carry everything.
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
    for (const bool asynchronous : {false, true}) {
      SCOPED_TRACE(c.name + (asynchronous ? ", relaxed apart" : ", in the tick"));
      Touch touch(load(block(c.young_Pa) + body(c.shape, c.mass_kg, 9.0, true)), kFarAway, asynchronous);
      const double weight = 9.81 * c.mass_kg;
      double fastest = 0.0, worst = 0.0;
      for (int n = 0; n < 4100; ++n) {
        touch.at(kFarAway);
        worst = std::max(worst, deepest(touch));
        if (n >= 4000) fastest = std::max(fastest, glm::length(free_body(touch).velocity_m_per_s));
      }
      EXPECT_GT(tests::supports_of(touch.world(), touch.state())[0].at_limit, 20U);
      EXPECT_LT(fastest, 1e-4);
      EXPECT_NEAR(carried_N(touch), weight, 0.01 * weight);
      EXPECT_LE(worst, kOverlap);
      EXPECT_EQ(touch.state().faults, 0U);
      if (c.shape != kBall) continue;
      // A body that is moved to the same place on a path must be carried equally.
      const dvec3 rest_mm = 1e3 * touch.state().rigid[0].pose.position_m;
      Touch held(load(block(c.young_Pa) + pushed_to(rest_mm)), kFarAway, asynchronous);
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

// Two bodies lie on the same tissue, with links at their limits. The tissue carries both weights.
TEST_F(FreeOnTissue, TwoBodiesInOneObjectComeToRestAndAreBothCarried) {
  const std::string box = "primitive = \"box\"\nsize = [14, 10, 12]\n";
  struct Case {
    std::string shape;  // shape of the second body
    double mass_kg, x_mm;
  };
  for (const Case& c : {Case{kBall, 0.02, 14.0}, Case{box, 0.05, 14.0}}) {
    for (const bool asynchronous : {false, true}) {
      SCOPED_TRACE(std::to_string(c.mass_kg) + " kg at " + std::to_string(c.x_mm) +
                   (asynchronous ? ", relaxed apart" : ", in the tick"));
      std::string second = body(c.shape, c.mass_kg, 9.0, true, "", c.x_mm);
      second.replace(second.find("\"body\""), 6, "\"second\"");
      Touch touch(load(block(5e3) + body(kBall, 0.05, 9.0, true, "", -c.x_mm) + second), kFarAway,
                  asynchronous);
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
      EXPECT_GT(tests::supports_of(touch.world(), touch.state())[0].at_limit, 20U);
      EXPECT_LT(fastest, 1e-4);
      EXPECT_NEAR(carried_N(touch), weight, 0.01 * weight);
      EXPECT_LE(worst, kOverlap);
      EXPECT_EQ(touch.state().faults, 0U);
    }
  }
}

// The force that carries a body held at one place is the derivative of the springs' energy with respect to
// that place, with either kind of relaxation. A free box at the same place may be carried by another force,
// because it may have turned and may touch other voxels.
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
    std::array<double, 2> energy_J{}, carried{};  // [1] is a little deeper
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
      EXPECT_GT(tests::supports_of(touch.world(), touch.state())[0].at_limit, 20U);
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

// Anchors carry the body through links at their limits, whose forces the springs do not show. Wherever the
// body first meets the lattice, it must come to rest and hardly bounce.
TEST_F(FreeOnTissue, SoHeavyThatItSqueezesItOntoItsAnchorsABallComesToRest) {
  struct Case {
    double mass_kg, young_Pa, x_mm;
  };
  for (const Case& c : {Case{10.0, 1e3, 0.3}, Case{10.0, 1e3, 1.1}, Case{3.0, 1e3, 1.1}, Case{0.3, 2e3, 0.3},
                        Case{30.0, 1e4, 0.3}}) {
    for (const bool asynchronous : {false, true}) {
      SCOPED_TRACE(std::to_string(c.mass_kg) + " kg on " + std::to_string(c.young_Pa) + " Pa" +
                   (asynchronous ? ", relaxed apart" : ", in the tick"));
      Touch touch(load(block(c.young_Pa) + body(kBall, c.mass_kg, 9.0, true, "", c.x_mm)), kFarAway,
                  asynchronous);
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

// Between two results, asynchronously relaxed tissue acts as a spring. This must not sustain a bounce.
TEST_F(FreeOnTissue, ADroppedWeightComesToRest) {
  for (const bool asynchronous : {false, true}) {
    SCOPED_TRACE(asynchronous ? "relaxed apart" : "in the tick");
    Touch touch(hybrid::load_scene(tests::source_folder / "scenes/dropped-weight.toml"), kFarAway,
                asynchronous);
    const double weight = 9.81 * touch.world().rigid[0].motion.free_body().mass.mass_kg;
    for (int n = 0; n < 1000; ++n) touch.at(kFarAway);
    double fastest = 0.0;
    for (int n = 0; n < 200; ++n) {
      touch.at(kFarAway);
      fastest =
          std::max(fastest, std::abs(free_body(touch).velocity_m_per_s.z));  // only vertically, because the
                                                                             // body may slide over the tissue
    }
    EXPECT_LT(fastest, 1e-3);
    EXPECT_NEAR(carried_N(touch), weight, 0.02 * weight);
  }
}

TEST_F(FreeOnTissue, HeldStillByTheToolHandAndAnchorsBalance) {
  const double weight = 0.02 * 9.81;
  for (const bool asynchronous : {false, true}) {
    const std::string lying =
        "[[rigid]]\nname = \"body\"\nprimitive = \"box\"\nsize = [16, 16, 10]\n"
        "position = [0, 0, 5]\nfriction = 0.8\nmotion = \"free\"\nmass = 0.02\n"
        "gravity = [0, 0, -9.81]\n";
    Touch touch(load(block(2e4) + lying), {0.0, 0.0, 25e-3}, asynchronous);
    tests::OverlapChecker watch(touch.world(), touch.state());
    hybrid::TickResult felt;
    double worst = 0.0;
    for (int n = 0; n < 3000; ++n) {
      const double z = std::max(25e-3 - 0.02e-3 * n, 13e-3);
      felt = touch.at({0.0, 0.0, z});
      watch.check(touch.state(), felt);
      worst = std::max(worst, deepest(touch));
    }
    const double hand = tests::coupling(felt).z;
    EXPECT_GT(hand, 0.1);
    EXPECT_NEAR(hand + weight, carried_N(touch), 0.01 * carried_N(touch));
    EXPECT_LE(worst, kOverlap);
    EXPECT_LE(watch.tool_inside_m(), 5e-6);
  }
}

// A slab that is anchored at one side lies above a plate. A body lies on the slab, and the tool presses on
// the body until links of the slab are at their limits.
TEST_F(FreeOnTissue, SqueezedBetweenToolTissueAndBoneItStaysOutOfBoth) {
  const std::string slab =
      head(5e3) +
      "[[soft]]\nname = \"slab\"\nformula = \"block\"\nsize = [60, 40, 8]\nspacing = 2\n"
      "position = [0, 0, -4]\nmaterial = \"gel\"\n[soft.anchors]\nfaces = [\"-x\"]\nrigid_within = 0\n";
  const std::string plate =
      "[[rigid]]\nname = \"plate\"\nprimitive = \"box\"\nsize = [80, 60, 6]\nposition = [0, 0, -12]\n";
  for (const std::string& shape : {kBall, kBox}) {
    for (const bool asynchronous : {false, true}) {
      SCOPED_TRACE(std::string(shape == kBall ? "ball" : "box") + (asynchronous ? ", relaxed apart" : ""));
      std::string scene = slab;
      scene += body(shape, 0.02, 8.6, false, "drag = 0.5\nangular_drag = 1e-4\n");
      scene += plate;
      Touch touch(load(scene), {0.3e-3, 0.7e-3, 30e-3}, asynchronous);
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
