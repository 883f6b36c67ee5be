// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/lattice/plasticity.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace {

using voxel::link_energy_J;
using voxel::plastic_link;

TEST(Yield, IsElasticUpToItsStrainAndPerfectlyPlasticBeyond) {
  const double y = 2e-4;
  for (const double side : {-1.0, 1.0}) {
    const auto held = plastic_link(side * 1.9e-4, 0.0, y);
    EXPECT_EQ(held.elastic, side * 1.9e-4);
    EXPECT_EQ(held.offset, 0.0);
    const auto gone = plastic_link(side * 5e-4, 0.0, y);
    EXPECT_DOUBLE_EQ(gone.elastic, side * y);
    EXPECT_DOUBLE_EQ(gone.offset, side * 3e-4);
    // Unloaded, the link is at rest at its offset. Loading it again to the same difference does not change
    // the offset.
    EXPECT_EQ(plastic_link(gone.offset, gone.offset, y).elastic, 0.0);
    EXPECT_NEAR(plastic_link(side * 5e-4, gone.offset, y).offset, gone.offset, 1e-19);
  }
  const double never = std::numeric_limits<double>::infinity();
  EXPECT_EQ(plastic_link(1e3, 0.0, never).elastic, 1e3);
  EXPECT_EQ(plastic_link(1e3, 0.0, never).offset, 0.0);
}

TEST(Yield, LeavesNoLimitOfTheChain) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> number(-1.0F, 1.0F);
  for (int trial = 0; trial < 100'000; ++trial) {
    const float low = std::min(number(random), 0.0F), high = std::max(number(random), 0.0F);
    const auto inside = [&] { return std::clamp(number(random), low, high); };
    const float before = inside(), difference = inside(), yield = std::fabs(number(random)) * 0.3F;
    const auto link = plastic_link(difference, before, yield);
    EXPECT_GE(link.offset, std::min(before, difference) - 1e-7F);
    EXPECT_LE(link.offset, std::max(before, difference) + 1e-7F);
    EXPECT_LE(std::fabs(link.elastic), yield);
    // A second evaluation changes nothing beyond the rounding of a difference of up to 2.
    const auto again = plastic_link(difference, link.offset, yield);
    EXPECT_NEAR(again.offset, link.offset, 2.4e-7F);
  }
}

TEST(Yield, ForceIsTheSlopeOfItsEnergy) {
  const double k = 30.0, y = 1e-4, offset = 5e-5, step = 1e-9;
  for (int at = -30; at <= 30; ++at) {
    const double difference = 1.31e-5 * at;
    const double slope =
        (link_energy_J(k, difference + step, offset, y) - link_energy_J(k, difference - step, offset, y)) /
        (2 * step);
    EXPECT_NEAR(slope, k * plastic_link(difference, offset, y).elastic, 1e-6 * k * y);
  }
}

// The offset after loading does not depend on the number of steps. The same holds after a reversal.
TEST(Yield, IsTheSameForAnyNumberOfSteps) {
  const double y = 1e-4;
  for (const int steps : {1, 7, 1000}) {
    double offset = 0.0;
    const auto go = [&](double from, double to) {
      for (int s = 1; s <= steps; ++s)
        offset = plastic_link(from + (to - from) * s / steps, offset, y).offset;
    };
    go(0.0, 7e-4);
    EXPECT_NEAR(offset, 6e-4, 1e-15);
    go(7e-4, -2e-4);
    EXPECT_NEAR(offset, -1e-4, 1e-15);
  }
}

// A cycle of a link dissipates the energy of the closed form of perfect plasticity, 4·k·y·(amplitude − y).
TEST(Yield, SpendsTheAreaOfItsLoop) {
  const double k = 30.0, y = 1e-4, amplitude = 5e-4;
  double offset = 0.0, work = 0.0, last = 0.0, last_force = 0.0;
  constexpr int kSteps = 4000;
  for (int cycle = 0; cycle < 3; ++cycle) {
    work = 0.0;
    for (int s = 1; s <= kSteps; ++s) {
      const double phase = 4.0 * s / kSteps;  // 0 → 1 → 0 → −1 → 0
      const double difference = amplitude * (phase < 1 ? phase : phase < 3 ? 2 - phase : phase - 4);
      const auto link = plastic_link(difference, offset, y);
      work += 0.5 * (k * link.elastic + last_force) * (difference - last);
      offset = link.offset;
      last = difference;
      last_force = k * link.elastic;
    }
  }
  EXPECT_NEAR(work, 4 * k * y * (amplitude - y), 1e-3 * work);
}

// A bar of links in a row between a wall and a hand. sweep() is Gauss-Seidel on the energy of the step.
// For each voxel, bisection finds the place where the forces of its two links are equal.
struct Bar {
  std::vector<double> k, y, offset, u;

  Bar(std::vector<double> stiffness, std::vector<double> yield)
      : k(std::move(stiffness)), y(std::move(yield)), offset(k.size(), 0.0), u(k.size() + 1, 0.0) {}
  [[nodiscard]] double force(std::size_t link) const {
    return k[link] * plastic_link(u[link + 1] - u[link], offset[link], y[link]).elastic;
  }
  void sweep() {
    for (std::size_t v = 1; v + 1 < u.size(); ++v) {
      double low = std::min(u[v - 1], u[v + 1]) - 1.0, high = std::max(u[v - 1], u[v + 1]) + 1.0;
      for (int s = 0; s < 60; ++s) {
        u[v] = 0.5 * (low + high);
        (force(v - 1) < force(v) ? low : high) = u[v];
      }
    }
  }
  void keep() {
    for (std::size_t l = 0; l < k.size(); ++l)
      offset[l] = plastic_link(u[l + 1] - u[l], offset[l], y[l]).offset;
  }
  // Moves the hand to `to`. The offsets are updated once the bar has settled, and also after each sweep if
  // `keep_on_the_way`.
  void pull(double to, int sweeps, bool keep_on_the_way = false) {
    u.back() = to;
    for (int s = 0; s < sweeps; ++s) {
      sweep();
      if (keep_on_the_way) keep();
    }
    keep();
  }
};

// Links of 10, 20 and 40 N/m in a row yield at 5, 3 and 8 N. The weakest link takes all of the plastic
// elongation.
TEST(Yield, ABarKeepsWhatItsWeakestLinkDoes) {
  const std::vector<double> k{10, 20, 40}, y{0.5, 0.15, 0.2};
  const double series = 1 / (1.0 / 10 + 1.0 / 20 + 1.0 / 40), weakest = 3.0;
  for (const int sweeps : {200, 2000}) {
    for (const int steps : {1, 5}) {
      Bar bar(k, y);
      for (int s = 1; s <= steps; ++s) bar.pull(1.0 * s / steps, sweeps);
      EXPECT_NEAR(bar.force(0), weakest, 1e-9);
      EXPECT_NEAR(bar.offset[1], 1.0 - weakest / series, 1e-9);
      EXPECT_EQ(bar.offset[0], 0.0);
      EXPECT_EQ(bar.offset[2], 0.0);
      // The bar is moved back until its force is 0. It is longer by exactly the offset of the weakest link.
      bar.pull(1.0 - weakest / series, sweeps);
      EXPECT_NEAR(bar.force(0), 0.0, 1e-9);
      EXPECT_NEAR(bar.offset[1], 1.0 - weakest / series, 1e-9);
    }
  }
}

// Offsets are updated only at rest. Just after a pull, all of the elongation is in the last link, which would
// yield although no link yields at rest.
TEST(Yield, OffsetsKeptOnTheWayKeepTheWayToo) {
  const std::vector<double> k(8, 10.0), y(8, 0.2);
  Bar waits(k, y), hurries(k, y);
  waits.pull(1.2, 3000);  // 0.15 per link, so no link yields
  hurries.pull(1.2, 3000, true);
  for (const double p : waits.offset) EXPECT_EQ(p, 0.0);
  EXPECT_GT(hurries.offset.back(), 0.1);
}

}  // namespace
