// SPDX-License-Identifier: GPL-3.0-or-later
// The measured boundaries of the haptic loop against theory, at a few settings. `hybrid stability` measures
// all settings. The perception of vibrations is tested too.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "hybrid/base/find_threshold.h"
#include "hybrid/stability/plot.h"
#include "hybrid/stability/stability.h"
#include "hybrid/stability/table.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"

namespace {

using hybrid::LoopSetting;

hybrid::Scene wall_scene() {
  return hybrid::load_scene(std::string(HYBRID_SOURCE_DIR) + "/scenes/wall.toml");
}

hybrid::PressedScene& wall() {
  static hybrid::PressedScene scene(wall_scene());
  return scene;
}

LoopSetting bare(double viscous, int delay = 0, double wall_damping = 0.0, double rate_hz = 1000.0) {
  LoopSetting setting;
  setting.mechanism.viscous_N_s_per_m = viscous;
  setting.hand = {.mass_kg = 0.0, .damping_N_s_per_m = 0.0, .stiffness_N_per_m = 0.0};
  setting.delay_ticks = delay;
  setting.wall_damping_N_s_per_m = wall_damping;
  setting.rate_hz = rate_hz;
  return setting;
}

// ---- stability ------------------------------------------------------------------------------------------

void expect_stable_as_eigenvalues_say(const LoopSetting& setting, const std::string& what) {
  const double theory = device::largest_stable_stiffness(hybrid::held_loop(setting));
  const double measured = hybrid::measured_stable_stiffness(wall(), setting).value_or(0.0);
  std::printf("stable, %s: %.1f N/m, eigenvalues %.1f (%+.3f %%)\n", what.c_str(), measured, theory,
              100.0 * (measured / theory - 1.0));
  EXPECT_NEAR(measured / theory, 1.0, 0.01) << what;
}

TEST(MeasuredStability, IsThatOfTheEigenvalues) {
  expect_stable_as_eigenvalues_say(bare(0.5), "b 0.5");
  expect_stable_as_eigenvalues_say(bare(5.0, 1), "b 5, one tick of delay");
  expect_stable_as_eigenvalues_say(bare(4.0, 0, 20.0), "b 4, B 20");
  expect_stable_as_eigenvalues_say(bare(4.0, 2, 30.0), "b 4, B 30, two ticks");
  expect_stable_as_eigenvalues_say(bare(2.0, 1, 0.0, 500.0), "b 2, 500 Hz, one tick");
  LoopSetting firm;
  firm.hand = device::hand_of(device::Grip::firm);
  firm.delay_ticks = 2;
  expect_stable_as_eigenvalues_say(firm, "a firm grip, two ticks");
}

// The value of the growth rate, not only its sign, is that of the largest eigenvalue.
TEST(MeasuredStability, TheEnvelopeGrowsByTheSpectralRadius) {
  const LoopSetting setting = bare(1.0);
  for (const double stiffness : {1960.0, 1995.0, 2010.0, 2050.0}) {
    const double rate = std::log(device::spectral_radius(hybrid::held_loop(setting), stiffness)) * 1000.0;
    EXPECT_NEAR(hybrid::envelope_growth(wall(), setting, stiffness), rate, 2e-3 + 5e-3 * std::fabs(rate))
        << stiffness << " N/m";
  }
}

// ---- passivity ------------------------------------------------------------------------------------------

// At every frequency, the measured damping that absorbs the energy from the wall equals the damping of the
// formula.
TEST(MeasuredPassivity, EveryFrequencyNeedsTheDampingOfTheFormula) {
  constexpr double kStiffness = 1500.0;
  for (const LoopSetting& setting : {bare(1.0), bare(1.0, 1), bare(1.0, 2, 0.8), bare(1.0, 0, 2.0, 4000.0)}) {
    wall().restart(setting, kStiffness);
    for (int cycles = 1; cycles <= 64; cycles += 7) {
      const hybrid::DrivenMotion motion{.cycles = cycles, .phase_rad = 1.0};
      const hybrid::CycleEnergy energy = hybrid::drive(wall(), setting, motion);
      const double needed =
          energy.from_wall_J / energy.dissipated_J;  // damping in units of the mechanism's, which is 1 N·s/m
      const double theta = 2.0 * std::numbers::pi * cycles / motion.ticks;
      EXPECT_NEAR(needed, device::passive_damping_at(hybrid::bare_loop(setting), kStiffness, theta), 1e-5)
          << cycles << " cycles, delay " << setting.delay_ticks;
    }
  }
}

TEST(MeasuredPassivity, IsThatOfColgateAndSchenkel) {
  for (const LoopSetting& setting : {bare(2.0, 1), bare(4.0, 0, 2.5), bare(4.0, 1, 3.5), bare(3.0, 2)}) {
    const double theory = device::largest_passive_stiffness(hybrid::bare_loop(setting));
    const double measured = hybrid::measured_passive_stiffness(wall(), setting).value_or(0.0);
    std::printf("passive, b %.1f, B %.1f, delay %d: %.1f N/m, theory %.1f (%+.3f %%)\n",
                setting.mechanism.viscous_N_s_per_m, setting.wall_damping_N_s_per_m, setting.delay_ticks,
                measured, theory, 100.0 * (measured / theory - 1.0));
    EXPECT_NEAR(measured / theory, 1.0, 0.03);
  }
}

// With the account of damping work, the tick suspends damping that would return energy. So a damped wall is
// as passive as one without damping.
TEST(MeasuredPassivity, TheAccountOfDampingTakesItsPartAway) {
  for (const bool account : {false, true}) {
    LoopSetting setting = bare(4.0, 0, 3.5);
    setting.damping_account = account;
    double worst = 0.0;  // energy from the wall, relative to the dissipated energy
    wall().restart(setting, 0.98 * 2.0 * 4.0 * 1000.0);
    for (int cycles = 1; cycles <= 64; cycles += 3) {
      const hybrid::CycleEnergy energy = hybrid::drive(
          wall(), setting, {.cycles = cycles, .centre_m = 2e-4, .amplitude_m = 2e-6, .phase_rad = 1.0});
      worst = std::max(worst, energy.from_wall_J / energy.dissipated_J);
    }
    if (account) {
      EXPECT_LE(worst, 1.0);
    } else {
      EXPECT_GT(worst, 1.5) << "left alone it is not passive here";
    }
  }
}

TEST(MeasuredPassivity, FrictionAndEncoderAreNotWorseThanAbbottAndOkamura) {
  LoopSetting setting = bare(2.0);
  for (const auto& [friction, step] : {std::pair{0.04, 30e-6}, std::pair{0.04, 10e-6}}) {
    setting.mechanism.limits.friction_N = friction;
    setting.mechanism.limits.resolution_m = step;
    const double bound = device::friction_and_quantisation_bound(2.0, 1e-3, friction, step);
    const double measured = hybrid::measured_passive_stiffness(wall(), setting).value_or(1e9);
    EXPECT_GE(measured, 0.999 * bound);
    EXPECT_LE(measured, 1.1 * bound) << "and there is a motion that nearly reaches it";
  }
}

// ---- buzz -----------------------------------------------------------------------------------------------

TEST(Buzz, BeginsNotBelowItsBoundAndIsFeltAboveIt) {
  LoopSetting held;
  held.mechanism = device::mechanism(device::DeviceModel::premium_1_5);
  const double bound = device::friction_and_quantisation_bound(hybrid::held_loop(held).damping_N_s_per_m,
                                                               1e-3, held.friction_N(), held.encoder_m());
  for (const double share : {0.1, 0.5, 0.95})
    EXPECT_LT(hybrid::pressed_vibration(wall(), held, share * bound).felt, 1.0) << share;
  const double unstable = 1.5 * device::largest_stable_stiffness(hybrid::held_loop(held));
  EXPECT_GT(hybrid::pressed_vibration(wall(), held, unstable).felt, 1.0);
}

TEST(Vibration, ThresholdOfTheSkin) {
  EXPECT_NEAR(hybrid::vibration_threshold_m(5.0), 25e-6, 1e-12);
  EXPECT_NEAR(hybrid::vibration_threshold_m(30.0), 25e-6, 1e-12);
  EXPECT_NEAR(20.0 * std::log10(hybrid::vibration_threshold_m(120.0) / hybrid::vibration_threshold_m(60.0)),
              -12.0, 1e-9);
  EXPECT_LT(hybrid::vibration_threshold_m(250.0), 1e-6);
  EXPECT_EQ(hybrid::vibration_threshold_m(300.0), hybrid::vibration_threshold_m(900.0));
  EXPECT_TRUE(std::isinf(hybrid::vibration_threshold_m(1001.0)));
}

TEST(Vibration, AToneIsFoundWithItsAmplitudeWhereverItLies) {
  for (const double frequency : {40.0, 101.0, 100.5, 317.3}) {
    std::vector<double> motion;
    motion.reserve(1000);
    for (int n = 0; n < 1000; ++n)  // with a drift, as during a press that creeps
      motion.push_back(2e-3 + 1e-7 * n +
                       3e-6 * std::sin(2.0 * std::numbers::pi * frequency * n / 2000.0 + 0.4));
    const hybrid::Vibration found = hybrid::strongest_vibration(motion, 2000.0);
    EXPECT_NEAR(found.frequency_hz, frequency, 2.01);
    EXPECT_NEAR(found.amplitude_m / 3e-6, 1.0, 0.02) << frequency;
    EXPECT_NEAR(found.felt, found.amplitude_m / hybrid::vibration_threshold_m(found.frequency_hz), 1e-9);
  }
}

TEST(Vibration, OfTwoTonesTheOneThatIsFelt) {
  std::vector<double> motion;
  motion.reserve(1000);
  for (int n = 0; n < 1000; ++n) {
    const double t = n * 1e-3;
    motion.push_back(20e-6 * std::sin(2.0 * std::numbers::pi * 20.0 * t) +
                     1e-6 * std::sin(2.0 * std::numbers::pi * 200.0 * t));
  }
  EXPECT_NEAR(hybrid::strongest_vibration(motion, 1000.0).frequency_hz, 200.0, 1.0);
  EXPECT_LT(hybrid::strongest_vibration(std::vector<double>(500, 1e-3), 1000.0).felt, 1e-6);
  EXPECT_EQ(hybrid::strongest_vibration(std::vector<double>(5, 1.0), 1000.0).felt, 0.0);
}

// ---- the search, refusals and the report ------------------------------------------------------------

TEST(FirstNotSo, IsTheLeastBoundaryOrNone) {
  const auto below = [](double limit) { return [limit](double x) { return x < limit; }; };
  EXPECT_NEAR(*hybrid::find_threshold(1.0, 1e6, 2.0, 1e-4, below(777.0)), 777.0, 0.1);
  EXPECT_EQ(hybrid::find_threshold(1.0, 1e6, 2.0, 1e-4, below(0.5)), 0.0);
  EXPECT_EQ(hybrid::find_threshold(1.0, 1e6, 2.0, 1e-4, below(1e9)), std::nullopt);
}

class StabilityScene : public tests::SceneFile {};

TEST_F(StabilityScene, APathThatTouchesNothingIsRefused) {
  hybrid::Scene scene = wall_scene();
  scene.path = device::PressPath{.from_m = {0, 0, 0.05}, .to_m = {0, 0, 0.04}};
  try {
    const hybrid::PressedScene pressed(scene);
    FAIL() << "not refused";
  } catch (const hybrid::SceneError& e) {
    EXPECT_NE(std::string(e.what()).find("touches nothing"), std::string::npos) << e.what();
  }
}

hybrid::StabilityReport little_report() {
  hybrid::StabilityReport report;
  for (const double b : {1.0, 2.0}) {
    hybrid::StabilityRow row;
    row.setting = bare(b, 1);
    row.theory = 1000.0 * b;
    row.theory_name = "as if";
    row.measured = 1010.0 * b;
    report.rows.push_back(row);
  }
  report.rows[1].lower_bound = 3000.0;
  return report;
}

TEST(StabilityReport, SaysHowFarOffAndHowManyBelow) {
  const hybrid::StabilityReport report = little_report();
  EXPECT_EQ(hybrid::agreement(report, hybrid::Boundary::stable).rows, 2);
  EXPECT_NEAR(hybrid::agreement(report, hybrid::Boundary::stable).worst, 0.01, 1e-12);
  EXPECT_EQ(hybrid::below_bound(report), 1);
  nlohmann::ordered_json json;
  hybrid::add_to_json(report, json);
  for (const char* key : {"stiffness_N_per_m", "damping_N_s_per_m", "rate_hz", "delay_s", "quantisation_m",
                          "grip", "kind", "measured", "theory", "theory_name"})
    EXPECT_TRUE(json["rows"][0].contains(key)) << key;
  EXPECT_EQ(json["rows"][0]["kind"], "stable");
  EXPECT_EQ(json["rows"][0]["delay_s"], 1e-3);
}

TEST_F(StabilityScene, ThePlotHasALineAndADotForEachMeasurement) {
  const std::string svg = hybrid::to_svg(
      hybrid::stability_figure({{.x_label = "b",
                                 .panels = {{.title = "Stable",
                                             .curves = {{.name = "no delay",
                                                         .x = {0.0, 1.0, 2.0},
                                                         .theory_N_per_m = {0.0, 1000.0, 2000.0},
                                                         .measured_x = {0.5, 1.0, 1.5},
                                                         .measured_N_per_m = {500.0, 1001.0, 1500.0}}}}}}},
                               "Wall", {}));
  EXPECT_NE(svg.find("no delay"), std::string::npos);
  int dots = 0;
  for (std::size_t at = svg.find("h0"); at != std::string::npos; at = svg.find("h0", at + 1)) ++dots;
  EXPECT_GE(dots, 6) << "three dots with their rims";
}

}  // namespace
