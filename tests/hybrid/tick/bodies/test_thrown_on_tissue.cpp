// SPDX-License-Identifier: GPL-3.0-or-later
// Free bodies thrown at tissue: they do not overlap it, gain no energy, and leave it cleanly.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <random>
#include <string>
#include <vector>

#include "hybrid/world/free_body.h"
#include "polygon/files/mesh_file.h"
#include "polygon/surface/primitives.h"
#include "tests/hybrid/fixtures/free_on_tissue.h"
#include "tests/hybrid/fixtures/touch.h"
#include "voxel/chain/chainmail.h"

namespace {

using glm::dvec3;
using tests::Touch;
using namespace tests::free_on_tissue;  // NOLINT(google-build-using-namespace): these tests use the whole
                                        // fixture

// Tissue returns less energy than it took. The compared energy is that of the body without the tissue.
TEST_F(FreeOnTissue, ThrownAtItABodyNeitherOverlapsNorGainsEnergy) {
  for (const std::string& shape : {kBall, kBox}) {
    for (const double mass : {1e-3, 0.1, 10.0}) {
      for (const double young : {1e3, 3e4, 1e6}) {
        for (const int variant : {0, 1, 2, 3}) {
          const bool gravity = (variant & 1) != 0, asynchronous = (variant & 2) != 0;
          SCOPED_TRACE(std::string(shape == kBall ? "ball" : "box") + " of " + std::to_string(mass) +
                       " kg on " + std::to_string(young) + " Pa" + (gravity ? ", falling" : "") +
                       (asynchronous ? ", relaxed apart" : ""));
          Touch touch(load(block(young) + body(shape, mass, 9.5, gravity)), kAside, asynchronous);
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
    const bool gravity = one(random) > 0.0, asynchronous = one(random) > 0.0;
    SCOPED_TRACE("case " + std::to_string(n));
    Touch touch(load(block(young) + body(shapes[n % shapes.size()], mass, 16.0, gravity)), kAside,
                asynchronous);
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
  for (const bool asynchronous : {false, true}) {
    Touch touch(load(block(1e4) + body(kBall, 0.01, 8.5, false)), kAside, asynchronous);
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

}  // namespace
