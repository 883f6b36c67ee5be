// SPDX-License-Identifier: GPL-3.0-or-later
// The energy that a contact returns, if the tissue's force is not the gradient of an energy.
#include "voxel/object/contact_energy_observer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

namespace {

// Tissue whose force along z is a power of the depth. It is stiffer towards x = 0.
struct Tissue {
  double power, stiffer_per_m;
  [[nodiscard]] glm::dvec3 force_N(const glm::dvec3& tool) const {
    const double depth = std::max(-tool.z, 0.0);
    return {0.0, 0.0, (1.0 - stiffer_per_m * std::fabs(tool.x)) * std::pow(1e3 * depth, power)};
  }
};

struct Hand {
  Tissue tissue;
  voxel::ContactEnergy energy;
  glm::dvec3 at{0.0}, felt_N{0.0};
  double gained_J = 0.0, given_J = 0.0, most_taken_N = 0.0;

  // Moves the hand straight to `to`, by `step_m` per tick.
  void go(const glm::dvec3& to, double step_m) {
    const glm::dvec3 from = at;
    const int ticks = static_cast<int>(std::ceil(glm::distance(from, to) / step_m));
    for (int n = 1; n <= ticks; ++n) {
      const glm::dvec3 next = from + (to - from) * (static_cast<double>(n) / ticks);
      const glm::dvec3 force_N = tissue.force_N(next);
      energy.account(next - at, force_N, -next.z);
      const glm::dvec3 felt = energy.share() * force_N;
      const double work_J = 0.5 * glm::dot(felt_N + felt, next - at);
      gained_J += work_J;
      given_J += std::max(-work_J, 0.0);
      most_taken_N = std::max(most_taken_N, glm::distance(force_N, felt));
      felt_N = felt;
      at = next;
    }
  }
};

TEST(ContactEnergy, WhatGoesInComesOutWhole) {
  for (const double power : {1.0, 1.5, 2.0}) {
    Hand hand{{power, 0.0}, {}};
    hand.energy.begin();
    for (int press = 0; press < 3; ++press) {
      hand.go({0.0, 0.0, -5e-3}, 1e-4);
      hand.go({5e-3, 0.0, -5e-3}, 1e-4);
      hand.go({0.0, 0.0, 0.0}, 1e-4);
    }
    EXPECT_LT(hand.most_taken_N, 1e-2 * std::pow(5.0, power)) << power;
    EXPECT_NEAR(hand.gained_J, 0.0, 5e-4 * hand.given_J);
  }
}

// The tool goes in where the tissue is soft and out where it is stiff, repeatedly. It must gain no energy.
TEST(ContactEnergy, ATissueThatIsStifferWhereAToolLeavesGivesNothing) {
  for (const double stiffer :
       {1.0, 2.0, 4.0}) {  // per meter; the stiffness changes by 0.5, 1 and 2 % along the sideways path
    Hand hand{{2.0, stiffer}, {}};
    hand.energy.begin();
    for (int press = 0; press < 4; ++press) {
      hand.go({5e-3, 0.0, 0.0}, 2e-5);
      hand.go({5e-3, 0.0, -5e-3}, 2e-5);
      hand.go({0.0, 0.0, -5e-3}, 2e-5);
      hand.go({0.0, 0.0, -5e-5}, 2e-5);
      EXPECT_LE(hand.gained_J, 1e-4 * hand.given_J) << stiffer;
    }
    EXPECT_GT(hand.most_taken_N, 0.0);
  }
}

// A reduced share returns to 1 while the tool presses on.
TEST(ContactEnergy, PressingOnRegainsTheForce) {
  Hand hand{{2.0, 60.0}, {}};
  hand.energy.begin();
  hand.go({5e-3, 0.0, -3e-3}, 2e-5);
  hand.go({0.0, 0.0, -3e-3}, 2e-5);
  hand.go({0.0, 0.0, -5e-4}, 2e-5);
  EXPECT_LT(hand.energy.share(), 0.9);
  hand.go({0.0, 0.0, -3e-3}, 2e-5);
  EXPECT_GT(hand.energy.share(), 0.99);
}

// A contact that exists when a session begins may return its stored energy.
TEST(ContactEnergy, WhatIsThereAtTheBeginningMayBeGiven) {
  Hand hand{{2.0, 0.0}, {}, {0.0, 0.0, -3e-3}};
  hand.energy.begin();
  hand.energy.account({}, hand.tissue.force_N(hand.at), 3e-3);
  hand.felt_N = hand.tissue.force_N(hand.at);
  hand.go({0.0, 0.0, 0.0}, 2e-5);
  EXPECT_EQ(hand.energy.share(), 1.0);
}

}  // namespace
