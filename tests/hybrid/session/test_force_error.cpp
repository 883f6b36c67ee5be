// SPDX-License-Identifier: GPL-3.0-or-later
// The force error of a session, against a slow run of the same scene.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "hybrid/feel/just_noticeable.h"
#include "hybrid/session/force_error.h"
#include "tests/hybrid/fixtures/touch.h"

namespace {

class ForceErrorOfRun : public tests::SceneFile {};

hybrid::SessionOptions options(int samples, std::optional<double> seconds = {}) {
  hybrid::SessionOptions options;
  options.seconds = seconds;
  options.reference_samples = samples;
  options.async_relaxation = true;
  return options;
}

// A scene with a block beside a rigid ball. The tool presses at `speed` mm/s and holds.
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

// Largest difference in JND from the same path run ten times slower. The slow run stands for the equilibrium,
// so no reference solver is needed. The forces are compared at equal positions along the path.
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
    // At a stop, many ticks of the slow run have this position. The last of them is taken, because the slow
    // run is then at rest.
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
  const hybrid::SessionResult fast = play(100.0, 1'000'000), slow = play(10.0, 0);
  const double worst = slow_run_jnd(fast.rows, slow.rows, hybrid::kJndFloor_N);
  EXPECT_GE(fast.error.moving.samples, 100);
  EXPECT_GE(fast.error.still.samples, 700);
  EXPECT_EQ(fast.error.all.samples, fast.error.moving.samples + fast.error.still.samples);
  EXPECT_LT(fast.error.still.max_jnd, fast.error.moving.max_jnd);
  const hybrid::SessionResult few = play(100.0, 24);
  EXPECT_LE(few.error.all.samples, 24);
  EXPECT_GE(few.error.all.samples, 20);
  EXPECT_GT(worst, 0.5) << "the scene is meant to show an error";
  EXPECT_LT(fast.error.all.max_jnd, 1.5 * worst);
  EXPECT_GT(fast.error.all.max_jnd, worst / 1.5);
}

TEST(ForceErrorWords, SayHowLongItTakes) {
  hybrid::ForceError error;
  error.not_measured = "nothing is soft";
  EXPECT_EQ(hybrid::in_words(error), "not measured: nothing is soft");
  error.all = error.moving = {.samples = 9, .max_N = 0.1, .rms_N = 0.1, .max_jnd = 0.9, .worst_t_s = 1.0};
  EXPECT_EQ(hybrid::in_words(error), "felt as at rest, within 1 JND");
  error.all.max_jnd = error.moving.max_jnd = 4.62;
  error.still = {.samples = 9, .max_N = 0.1, .rms_N = 0.1, .max_jnd = 3.0, .worst_t_s = 1.0};
  error.within_after_s = 0.3;
  EXPECT_EQ(hybrid::in_words(error),
            "up to 4.6 JND while the tool moves, up to 3.0 JND when it is still, within 1 JND from 0.3 s on");
}

TEST_F(ForceErrorOfRun, IsNamedWhereItIsNotMeasured) {
  const hybrid::Scene scene = load(beside_a_ball(100.0));
  hybrid::BuiltScene none = hybrid::build_scene(scene);
  EXPECT_EQ(hybrid::run_session(scene, none, options(0, 0.05)).error.not_measured,
            "no samples were asked for");
  hybrid::BuiltScene air = hybrid::build_scene(scene);
  EXPECT_EQ(hybrid::run_session(scene, air, options(1, 0.01)).error.not_measured, "nothing soft was touched");
}

}  // namespace
