// SPDX-License-Identifier: GPL-3.0-or-later
// The force error of a session, against a slow run of the same scene.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "hybrid/feel/just_noticeable.h"
#include "hybrid/session/force_error.h"
#include "tests/hybrid/fixtures/equilibrium.h"
#include "tests/hybrid/fixtures/touch.h"

namespace {

class ForceErrorOfRun : public tests::SceneFile {};

hybrid::SessionOptions options(bool measure_error, std::optional<double> seconds = {},
                               hybrid::Reference reference = hybrid::Reference::quick) {
  hybrid::SessionOptions options;
  options.seconds = seconds;
  options.measure_error = measure_error;
  options.reference = reference;
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
  const auto play = [&](double speed, bool measure_error,
                        hybrid::Reference reference = hybrid::Reference::quick) {
    const hybrid::Scene scene = load(beside_a_ball(speed));
    hybrid::BuiltScene built = hybrid::build_scene(scene);
    return hybrid::run_session(scene, built, options(measure_error, {}, reference));
  };
  const hybrid::SessionResult fast = play(100.0, true), slow = play(10.0, false);
  const double worst = slow_run_jnd(fast.rows, slow.rows, hybrid::kJndFloor_N);
  EXPECT_GE(fast.error.moving.samples, 100);
  EXPECT_GE(fast.error.still.samples, 700);
  EXPECT_EQ(fast.error.all.samples, fast.error.moving.samples + fast.error.still.samples);
  EXPECT_LT(fast.error.still.max_jnd, fast.error.moving.max_jnd);
  EXPECT_EQ(static_cast<std::uint64_t>(fast.error.all.samples), fast.object_contact_ticks[1])
      << "no tick with tissue in contact is left out";
  EXPECT_GT(worst, 0.3) << "the scene is meant to show an error";
  EXPECT_LT(fast.error.all.max_jnd, 1.5 * worst);
  EXPECT_GT(fast.error.all.max_jnd, worst / 1.5);
  const hybrid::SessionResult full = play(100.0, true, hybrid::Reference::full);
  EXPECT_EQ(fast.error.slower, hybrid::kQuickSlower);
  EXPECT_EQ(full.error.slower, hybrid::kSlower);
  EXPECT_EQ(full.error.all.samples, fast.error.all.samples) << "the same ticks are compared";
  EXPECT_LT(full.error.all.max_jnd, 1.2 * worst);
  EXPECT_GT(full.error.all.max_jnd, worst / 1.2);
}

// In shipped scenes that are solved voxel by voxel, the quick reference finds the error that the full one
// finds, within a factor of 1.5.
TEST(ForceErrorOfScenes, QuickAgreesWithFull) {
  for (const char* name : {"cleft", "tissue-on-bone", "edge-of-bone"}) {
    const hybrid::Scene scene =
        hybrid::load_scene(tests::source_folder / "scenes" / (std::string(name) + ".toml"));
    const auto play = [&](hybrid::Reference reference) {
      hybrid::BuiltScene built = hybrid::build_scene(scene);
      return hybrid::run_session(scene, built, options(true, {}, reference)).error;
    };
    const hybrid::ForceError quick = play(hybrid::Reference::quick), full = play(hybrid::Reference::full);
    EXPECT_LT(quick.all.max_jnd, 1.5 * full.all.max_jnd) << name;
    EXPECT_GT(quick.all.max_jnd, full.all.max_jnd / 1.5) << name;
    EXPECT_EQ(quick.all.samples, full.all.samples) << name;
    EXPECT_LT(quick.all.rms_N, 1.5 * full.all.rms_N) << name;
    EXPECT_GT(quick.all.rms_N, full.all.rms_N / 1.5) << name;
  }
}

// On nested patches, the full reference has patches twice as wide, and the quick one has those of the
// session. So the full one also finds the error of the patches, which is at most 5 % of the force here.
TEST(ForceErrorOfScenes, FullAlsoFindsTheErrorOfPatches) {
  const hybrid::Scene scene = hybrid::load_scene(tests::source_folder / "scenes/cube.toml");
  const auto play = [&](hybrid::Reference reference) {
    hybrid::BuiltScene built = hybrid::build_scene(scene);
    EXPECT_TRUE(built.state->soft[0]->uses_patches());
    return hybrid::run_session(scene, built, options(true, {}, reference)).error;
  };
  const hybrid::ForceError quick = play(hybrid::Reference::quick), full = play(hybrid::Reference::full);
  EXPECT_GT(full.all.max_jnd, quick.all.max_jnd / 1.5);
  EXPECT_LT(full.all.max_jnd, quick.all.max_jnd + 0.05 / hybrid::kJndShare);
}

// While the device is still, the quick reference may stop being slow, but not before the tissue is at rest.
// Here the course has the force of the equilibrium during the whole hold. So any error found is that of the
// reference itself.
TEST_F(ForceErrorOfRun, DoesNotRestTooEarly) {
  const hybrid::Scene scene = load(beside_a_ball(100.0));
  // The device arrives after 0.1 s, and holds until 0.5 s.
  constexpr double kInHold_s = 0.45;
  constexpr std::size_t kFrom = 130, kTo = 490;  // ticks
  hybrid::BuiltScene held = hybrid::build_scene(scene);
  (void)hybrid::run_session(scene, held, options(false, kInHold_s));
  const auto at_rest = tests::equilibrium_force(*held.world, *held.state);
  ASSERT_TRUE(at_rest);
  hybrid::BuiltScene whole = hybrid::build_scene(scene);
  const hybrid::SessionResult session = hybrid::run_session(scene, whole, options(false));
  hybrid::ForceCourse course;
  for (const hybrid::TraceRow& row : session.rows)
    course.push_back({row.device_m, *at_rest, course.size() >= kFrom && course.size() < kTo});
  hybrid::BuiltScene again = hybrid::build_scene(scene);
  hybrid::SlowRunOptions slow = hybrid::slow_run_options(hybrid::Reference::quick);
  slow.async_relaxation = true;
  hybrid::begin_session(scene, *again.world, *again.state, session.start_m);
  const hybrid::ForceError error = hybrid::compare_with_slow_run(*again.world, *again.state, course, slow);
  EXPECT_EQ(error.all.samples, static_cast<int>(kTo - kFrom));
  EXPECT_LT(error.all.max_jnd, 0.1) << "at " << error.all.worst_t_s << " s";
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
  EXPECT_EQ(hybrid::run_session(scene, none, options(false, 0.05)).error.not_measured,
            "it was not asked for");
  hybrid::BuiltScene air = hybrid::build_scene(scene);
  EXPECT_EQ(hybrid::run_session(scene, air, options(true, 0.01)).error.not_measured,
            "nothing soft was touched");
}

}  // namespace
