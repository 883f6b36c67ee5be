// SPDX-License-Identifier: GPL-3.0-or-later
// First contact, felt stiffness and fitted coupling against forces whose law is known.
#include "hybrid/tune/felt_stiffness.h"

#include <gtest/gtest.h>

#include <cmath>

namespace {

using hybrid::CourseTick;
using hybrid::ForceCourse;

constexpr double kDt_s = 1e-3, kCoupling = 800.0;

// A press from z = 0 to `deepest_m` and back, in 200 ticks. `law` gives the force at a depth.
template <class Law>
ForceCourse press(double deepest_m, const Law& law) {
  ForceCourse course;
  for (int t = 0; t <= 200; ++t) {
    const double depth_m = deepest_m * (1.0 - std::fabs(t - 100.0) / 100.0);
    course.push_back({{0.0, 0.0, -depth_m}, {0.0, 0.0, law(depth_m)}, depth_m > 0.0});
  }
  return course;
}

std::vector<double> depths(const ForceCourse& course) {
  std::vector<double> depth_m;
  for (const CourseTick& tick : course) depth_m.push_back(-tick.device_m.z);
  return depth_m;
}

TEST(FeltStiffness, OfASpringIsItsStiffness) {
  const auto course = press(3e-3, [](double d) { return 250.0 * d; });
  const auto slope = hybrid::felt_stiffness(course, depths(course), {0, course.size()});
  ASSERT_TRUE(slope);
  EXPECT_NEAR(*slope, 250.0, 1e-9);
}

// The least-squares slope of F = c d^1.5 over evenly spread depths up to D is 36/35 · c √D. The
// factor is the integral of 12 (x − 1/2) x^1.5 over 0 to 1, which is 12 (2/7 − 1/5).
TEST(FeltStiffness, OfHertzIsTheSlopeOfItsRegression) {
  const double deepest_m = 4e-3, c = 30.0;
  const auto course = press(deepest_m, [c](double d) { return c * std::pow(d, 1.5); });
  const auto slope = hybrid::felt_stiffness(course, depths(course), {0, course.size()});
  ASSERT_TRUE(slope);
  EXPECT_NEAR(*slope, 36.0 / 35.0 * c * std::sqrt(deepest_m), 0.01 * *slope);
}

TEST(FeltStiffness, OnlyTheFirstWayInCounts) {
  auto course = press(3e-3, [](double d) { return 250.0 * d; });
  for (std::size_t t = 101; t < course.size(); ++t) course[t].force_N *= 0.2;  // unloads along another curve
  EXPECT_NEAR(*hybrid::felt_stiffness(course, depths(course), {0, course.size()}), 250.0, 1e-9);
}

TEST(FeltStiffness, NeedsADepthThatChanges) {
  const ForceCourse held(50, CourseTick{{}, {0.0, 0.0, 1.0}, true});
  EXPECT_FALSE(hybrid::felt_stiffness(held, std::vector<double>(50, 1e-3), {0, 50}));
  EXPECT_FALSE(hybrid::felt_stiffness(held, {}, {0, 50}));
}

TEST(MatchStiffness, ASpringIsFoundExactly) {
  const auto tissue = press(3e-3, [](double d) { return 250.0 * d; });
  const auto proxy = press(3e-3, [](double d) { return kCoupling * d; });
  const auto match = hybrid::match_stiffness(tissue, proxy, kCoupling, {0, tissue.size()}, kDt_s);
  ASSERT_TRUE(match);
  EXPECT_NEAR(match->stiffness_N_per_m, 250.0, 1e-9);
  EXPECT_NEAR(match->max_N, 0.0, 1e-12);
  EXPECT_NEAR(match->depth_m, 3e-3, 1e-12);
  EXPECT_NEAR(match->force_N, 0.75, 1e-12);
}

// Brute force around the fit finds no stiffness with a smaller residual.
TEST(MatchStiffness, NoOtherStiffnessFitsHertzBetter) {
  const auto hertz = [](double d) { return 60.0 * std::pow(d, 1.5); };
  const auto tissue = press(3e-3, hertz);
  const auto proxy = press(3e-3, [](double d) { return kCoupling * d; });
  const auto match = hybrid::match_stiffness(tissue, proxy, kCoupling, {0, tissue.size()}, kDt_s);
  ASSERT_TRUE(match);
  EXPECT_GT(match->rms_N, 0.0);
  for (const double factor : {0.9, 0.99, 1.01, 1.1}) {
    double left = 0.0;
    for (const CourseTick& tick : tissue) {
      const double depth_m = -tick.device_m.z;
      left += std::pow(hertz(depth_m) - factor * match->stiffness_N_per_m * depth_m, 2);
    }
    EXPECT_GT(std::sqrt(left / static_cast<double>(tissue.size())), match->rms_N);
  }
}

TEST(MatchStiffness, NothingToFit) {
  const ForceCourse none(50, CourseTick{}), pulls(50, CourseTick{{}, {0.0, 0.0, -1.0}, true}),
      pushes(50, CourseTick{{}, {0.0, 0.0, 1.0}, true});
  EXPECT_FALSE(hybrid::match_stiffness(pushes, none, kCoupling, {0, 50}, kDt_s));
  EXPECT_FALSE(hybrid::match_stiffness(pulls, pushes, kCoupling, {0, 50}, kDt_s));
}

ForceCourse touches(const std::vector<std::pair<int, double>>& parts) {  // ticks, force; 0 N: not touched
  ForceCourse course;
  for (const auto& [ticks, force_N] : parts)
    course.resize(course.size() + ticks, {{}, {0, 0, force_N}, force_N > 0.0});
  return course;
}

TEST(FirstContact, BridgesShortGapsAndPassesOverWhatIsNotFelt) {
  const auto contact = hybrid::first_contact(
      touches({{10, 0.0}, {30, 0.01}, {50, 0.0}, {40, 0.5}, {15, 0.0}, {20, 0.5}, {100, 0.0}, {10, 0.5}}),
      0.04, kDt_s);
  ASSERT_TRUE(contact);
  EXPECT_EQ(contact->begin, 90U);
  EXPECT_EQ(contact->end, 165U);
  EXPECT_FALSE(hybrid::first_contact(touches({{10, 0.0}, {30, 0.01}}), 0.04, kDt_s));
}

}  // namespace
