// SPDX-License-Identifier: GPL-3.0-or-later
// The force error of a session: which ticks are sampled, and the reported error against a slow run.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "hybrid/feel/just_noticeable.h"
#include "hybrid/session/force_error.h"
#include "tests/hybrid/fixtures/touch.h"

namespace {

using hybrid::ErrorSample;
using hybrid::ForceCourse;

// In the air, pressing for 40 ticks, held for 2 s, moving off for 40 ticks, in the air.
ForceCourse press_and_hold() {
  ForceCourse course;
  const auto add = [&course](int ticks, double speed, bool soft, auto&& force) {
    for (int n = 0; n < ticks; ++n) course.push_back({{0.0, 0.0, force(n)}, speed, soft});
  };
  add(300, 0.1, false, [](int) { return 0.0; });
  add(40, 0.1, true, [](int n) { return 0.02 * n; });
  add(2000, 0.0, true, [](int n) { return n == 0 ? 0.85 : 0.8 * std::exp(-0.01 * n); });
  add(40, 0.1, true, [](int n) { return 0.1 - 0.0025 * n; });
  add(100, 0.1, false, [](int) { return 0.0; });
  return course;
}

TEST(ErrorSamples, AreInContactHalfOfThemWhileTheToolMoves) {
  const ForceCourse course = press_and_hold();
  const std::vector<ErrorSample> samples = hybrid::choose_error_samples(course, 24, 1e-3);
  ASSERT_EQ(samples.size(), 24U);
  int moving = 0;
  for (std::size_t n = 0; n < samples.size(); ++n) {
    EXPECT_TRUE(course[samples[n].tick].soft);
    if (n > 0) {
      EXPECT_GT(samples[n].tick, samples[n - 1].tick);
    }
    moving += samples[n].moving ? 1 : 0;
  }
  EXPECT_GE(moving, 12);
  EXPECT_LE(moving, 14);
  const auto has = [&](std::uint64_t tick) {
    return std::any_of(samples.begin(), samples.end(), [&](const ErrorSample& s) { return s.tick == tick; });
  };
  EXPECT_TRUE(has(340)) << "the largest force";
  EXPECT_TRUE(has(300 + 40 + 9)) << "10 ms after the stop";
  EXPECT_TRUE(has(300 + 40 + 999)) << "1 s after the stop";
}

TEST(ErrorSamples, OfAHeldToolAreStillAndOfAMovingOneMove) {
  ForceCourse held(500, {{0.0, 0.0, 1.0}, 0.0, true}), moved(10, {{0.0, 0.0, 1.0}, 0.1, true});
  const auto still = hybrid::choose_error_samples(held, 24, 1e-3);
  EXPECT_EQ(still.size(), 24U);
  EXPECT_TRUE(std::none_of(still.begin(), still.end(), [](const ErrorSample& s) { return s.moving; }));
  const auto moving = hybrid::choose_error_samples(moved, 24, 1e-3);
  EXPECT_EQ(moving.size(), 10U) << "each tick once";
  EXPECT_TRUE(hybrid::choose_error_samples(ForceCourse(50), 24, 1e-3).empty());
  EXPECT_TRUE(hybrid::choose_error_samples({}, 24, 1e-3).empty());
}

class ForceErrorOfRun : public tests::SceneFile {};

hybrid::SessionOptions options(int samples, std::optional<double> seconds = {}) {
  hybrid::SessionOptions options;
  options.seconds = seconds;
  options.reference_samples = samples;
  options.async_relaxation = true;
  return options;
}

// A block beside a rigid ball, pressed and held, at `speed` mm/s.
std::string beside_a_ball(double speed) {
  return "format = 1\n[material.gel]\nyoung = 10000\npoisson = 0.3\n"
         "[[soft]]\nname = \"block\"\nformula = \"block\"\nsize = [60, 60, 40]\nspacing = 2\nmaterial = "
         "\"gel\"\n"
         "anchors = { faces = [\"-z\"] }\n"
         "[[rigid]]\nname = \"ball\"\nprimitive = \"ball\"\nradius = 10\nposition = [45, 0, 20]\n"
         "[tool]\nradius = 8\n" +
         tests::unlimited + "[path]\nkind = \"waypoints\"\nspeed = " + std::to_string(speed) +
         "\npoints = [[0, 0, 32], [0, 0, 22, 0.4], [12, 0, 22, 0.4]]\n";
}

// The same path ten times slower stands in for the equilibrium, as it needs no reference solver. The two
// forces are compared where the device has come equally far along its path.
double slow_run_jnd(const std::vector<hybrid::TraceRow>& fast, const std::vector<hybrid::TraceRow>& slow,
                    double floor_N) {
  const auto lengths = [](const std::vector<hybrid::TraceRow>& rows) {
    std::vector<double> s{0.0};
    for (std::size_t n = 1; n < rows.size(); ++n)
      s.push_back(s.back() + glm::distance(rows[n].device_m, rows[n - 1].device_m));
    return s;
  };
  const std::vector<double> of_fast = lengths(fast), of_slow = lengths(slow);
  double worst = 0.0;
  for (std::size_t n = 0; n < fast.size(); ++n) {
    if (!(fast[n].soft_N > 1e-6)) continue;
    const double s = of_fast[n] * of_slow.back() / of_fast.back();
    // Of a stop, the last tick: there the slow run is at rest.
    const auto at = std::upper_bound(of_slow.begin(), of_slow.end(), s + 1e-9) - of_slow.begin() - 1;
    const auto reference = slow[static_cast<std::size_t>(at)].force_N;
    worst = std::max(worst, hybrid::jnd_of(fast[n].force_N, reference, floor_N));
  }
  return worst;
}

TEST_F(ForceErrorOfRun, AgreesWithASlowRun) {
  const auto play = [&](double speed, int samples) {
    const hybrid::Scene scene = load(beside_a_ball(speed));
    hybrid::BuiltScene built = hybrid::build_scene(scene);
    return hybrid::run_session(scene, built, options(samples));
  };
  const hybrid::SessionResult fast = play(100.0, 24), slow = play(10.0, 0);
  const double worst = slow_run_jnd(fast.rows, slow.rows, hybrid::kJndFloor_N);
  ASSERT_GE(fast.error.all.samples, 20) << fast.error.unsettled;
  EXPECT_GE(fast.error.moving.samples, 10);
  EXPECT_GT(worst, 0.5) << "the scene is meant to show an error";
  EXPECT_LT(fast.error.all.max_jnd, 1.5 * worst);
  EXPECT_GT(fast.error.all.max_jnd, worst / 1.5);
}

TEST_F(ForceErrorOfRun, IsNamedWhereItIsNotMeasured) {
  const hybrid::Scene scene = load(beside_a_ball(100.0));
  hybrid::BuiltScene none = hybrid::build_scene(scene);
  EXPECT_EQ(hybrid::run_session(scene, none, options(0, 0.05)).error.not_measured,
            "no samples were asked for");
  hybrid::BuiltScene air = hybrid::build_scene(scene);
  EXPECT_EQ(hybrid::run_session(scene, air, options(24, 0.01)).error.not_measured,
            "nothing soft was touched");
}

}  // namespace
