// SPDX-License-Identifier: GPL-3.0-or-later
// Smoothness of the felt force on tissue, and passivity of closed paths.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <random>

#include "hybrid/bench/force_continuity.h"
#include "tests/hybrid/fixtures/touch.h"

namespace {

using hybrid::bench::Smooth;
using hybrid::bench::StrokeCase;
using tests::between;

constexpr double kSpacing = 1e-3;

// Paths lead down, around at random depths, and back up to the start. Frictionless tissue returns at most the
// energy that it received.
TEST(ClosedPaths, GiveNoEnergy) {
  std::mt19937 engine(4);
  double most = -1.0, least = 0.0;
  for (const Smooth block : {Smooth::homogeneous, Smooth::layered, Smooth::oblique}) {
    for (const double speed : {0.02, 0.05, 0.1}) {
      for (int n = 0; n < 2; ++n) {
        StrokeCase stroke{
            .block = block, .radius_spacings = between(engine, 2.0, 6.0), .speed_m_per_s = speed};
        const auto ends = hybrid::bench::stroke_corners(stroke);
        const glm::dvec3 in = glm::normalize(ends[1] - ends[0]);
        const glm::dvec3 side = glm::normalize(glm::cross(in, glm::dvec3(0.3, 1.0, 0.2)));
        const glm::dvec3 other = glm::cross(in, side);
        std::vector<glm::dvec3> corners{ends[0], ends[0] + 0.5 * (ends[1] - ends[0])};
        for (int corner = 0; corner < 3; ++corner) {
          const double way = between(engine, 0.5, 3.0) * kSpacing,
                       angle = between(engine, 0.0, 2.0 * std::numbers::pi);
          corners.push_back(ends[0] + between(engine, 0.4, 1.0) * (ends[1] - ends[0]) +
                            way * (std::cos(angle) * side + std::sin(angle) * other));
        }
        corners.push_back(corners[1]);
        corners.push_back(corners[0]);
        const double work =
            hybrid::bench::work_of_stroke(hybrid::bench::stroke_scene(stroke), corners, speed);
        most = std::max(most, work);
        least = std::min(least, work);
        EXPECT_LE(work, 1e-6) << hybrid::bench::smooth_name(block) << " at " << speed << " m/s, ball of "
                              << stroke.radius_spacings << " spacings";
      }
    }
  }
  std::printf("closed paths: %.3g to %.3g uJ given to the hand\n", 1e6 * least, 1e6 * most);
}

// In slow strokes, the steps of the force exceed the steps of the equilibrium by at most a tenth of a JND.
// Faster strokes exceed them by more at their turning points, but by at most 1 JND.
TEST(Continuity, StepsAreThoseOfTheEquilibrium) {
  const StrokeCase slow{.radius_spacings = 2.0, .depth_spacings = 1.0, .speed_m_per_s = 0.01};
  const StrokeCase slide{
      .radius_spacings = 4.0, .depth_spacings = 1.5, .speed_m_per_s = 0.03, .slide_spacings = 3.0};
  for (const StrokeCase& stroke : {slow, slide}) {
    const auto result = hybrid::bench::measure_stroke(
        hybrid::bench::stroke_scene(stroke), hybrid::bench::stroke_corners(stroke), stroke.speed_m_per_s);
    std::printf(
        "%g spacings at %g m/s: steps beyond the equilibrium's p50 %.3f, p99 %.3f, at most %.3f JND\n",
        stroke.radius_spacings, stroke.speed_m_per_s, result.excess_p50_jnd, result.excess_p99_jnd,
        result.excess_max_jnd);
    EXPECT_GT(result.ticks, 100U);
    EXPECT_GT(result.force_max_N, 0.1);
    EXPECT_LE(result.excess_p50_jnd, 0.1);
    EXPECT_LE(result.excess_max_jnd, stroke.speed_m_per_s > 0.01 ? 1.0 : 0.1);
  }
}

}  // namespace
