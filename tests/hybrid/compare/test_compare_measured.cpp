// SPDX-License-Identifier: GPL-3.0-or-later
// A scene against measured forces. The measurements are synthetic and in closed form, so the error is known.
#include "hybrid/compare/compare_measured.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <glm/geometric.hpp>
#include <numbers>

#include "tests/hybrid/fixtures/scene_file_fixture.h"
#include "tests/shared_data.h"

namespace {

constexpr double kStiffness_N_per_m = 500.0;  // 0.5 N/mm, as in Ruffaldi et al. 2006
constexpr double kRadius_m = 0.02, kTool_m = 0.002;

class CompareMeasured : public tests::SceneFile {
 protected:
  hybrid::Scene scene() const {
    return hybrid::load_scene(
        write("ball.toml",
              "format = 1\n[[rigid]]\nname = \"ball\"\nprimitive = \"ball\"\nradius = 20\n"
              "[tool]\nradius = 2\nstiffness = 500\n[device]\nmodel = \"touch\"\n"
              "[path]\nkind = \"press\"\nfrom = [0, 0, 40]\nto = [0, 0, 20]\n"));
  }

  // Place of a probe that goes up and down over the ball's top, at most 4 mm deep, and also swings a little
  // sideways.
  static glm::dvec3 position(double t_s) {
    const double height = 0.024 - 0.006 * std::sin(2.0 * std::numbers::pi * t_s);
    const double aside = 0.3 * std::sin(2.0 * std::numbers::pi * 0.5 * t_s);
    return height * glm::dvec3(std::sin(aside), 0.0, std::cos(aside));
  }
  // The force of a ball of this stiffness on the probe's ball (N).
  static glm::dvec3 answer(const glm::dvec3& p) {
    const double depth = kRadius_m + kTool_m - glm::length(p);
    return depth > 0.0 ? kStiffness_N_per_m * depth * glm::normalize(p) : glm::dvec3(0.0);
  }

  std::filesystem::path trajectory(const std::string& name, const glm::dvec3& offset_N,
                                   bool strength_alone = false, double sign = 1.0) const {
    std::string text;
    for (int i = 0; i <= 2000; ++i) {
      const double t = 1e-3 * i;
      const glm::dvec3 p = 1e3 * position(t), f = sign * answer(position(t)) + offset_N;
      text += strength_alone
                  ? fmt::format("{:.4f} {:.17g} {:.17g} {:.17g} {:.17g}\n", t, p.x, p.y, p.z, glm::length(f))
                  : fmt::format("{:.4f} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g}\n", t, p.x, p.y, p.z,
                                f.x, f.y, f.z);
    }
    return write(name, text);
  }

  hybrid::MeasuredComparison compared(const std::filesystem::path& file) const {
    return hybrid::compare_measured(scene(), {.measured = {.file = file}, .along = {}}, {});
  }
};

TEST_F(CompareMeasured, AMeasurementInClosedFormIsMet) {
  const auto result = compared(trajectory("ball.traj", {0, 0, 0}));
  EXPECT_EQ(result.samples, 2001U);
  EXPECT_EQ(result.in_gaps, 0U);
  const hybrid::ModelResult& felt = result.comparison.models[0];
  double most = 0.0;
  for (const auto& row : felt.rows) most = std::max(most, glm::length(row.force_N));
  EXPECT_GT(most, 1.9) << "or the test shows nothing";
  // The path is linear between samples, which are 0.04 mm apart. At the samples themselves it has no error.
  EXPECT_LT(result.rms_N, 1e-6);
  EXPECT_LT(felt.max_N, 1e-6);
  EXPECT_EQ(felt.share_above_1_jnd, 0.0);
  EXPECT_LT(felt.direction_p99_deg, 1e-3);
  EXPECT_GT(felt.tick_us.max, 0.0);
  EXPECT_EQ(result.comparison.reference_text, "measured: ball.traj");
  EXPECT_EQ(result.comparison.reference, 1U);
}

TEST_F(CompareMeasured, AnOffsetOfTheForceIsTheRmsError) {
  for (const double offset_N : {0.01, 0.1, 0.5}) {
    const auto result = compared(trajectory("offset.traj", {0.0, 0.6 * offset_N, -0.8 * offset_N}));
    EXPECT_NEAR(result.rms_N, offset_N, 1e-6) << "over contact and free space alike";
    EXPECT_NEAR(result.comparison.models[0].max_N, offset_N, 1e-6);
  }
}

TEST_F(CompareMeasured, TheStrengthAloneIsComparedAsThat) {
  const auto result = compared(trajectory("strength.traj", {0, 0, 0}, true));
  EXPECT_LT(result.rms_N, 1e-6);
  EXPECT_THAT(result.comparison.note, testing::HasSubstr("only the strength"));
}

TEST_F(CompareMeasured, ForcesOnTheObjectAreNoticedAndTurned) {
  const auto file = trajectory("turned.traj", {0, 0, 0}, false, -1.0);
  const auto as_it_is = compared(file);
  EXPECT_GT(as_it_is.rms_N, 1.0);
  EXPECT_THAT(as_it_is.comparison.note, testing::HasSubstr("--on-object"));
  const auto turned =
      hybrid::compare_measured(scene(), {.measured = {.file = file, .on_object = true}, .along = {}}, {});
  EXPECT_LT(turned.rms_N, 1e-6);
}

// The evaluation of Ruffaldi et al. (2006) measures forces on the surface. A separate file without forces,
// the in-trajectory, drives the device below the surface by force / stiffness.
TEST_F(CompareMeasured, AnInTrajectoryDrivesTheDevice) {
  std::string raw = "t_s,x_mm,y_mm,z_mm,fx_N,fy_N,fz_N\n", in = "t_s,x_mm,y_mm,z_mm\n";
  for (int i = 0; i <= 1000; ++i) {
    const double t = 1e-3 * i;
    const glm::dvec3 below = position(t);
    const glm::dvec3 force = answer(below);
    const glm::dvec3 on_surface = below + force / kStiffness_N_per_m;
    raw += fmt::format("{:.4f},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g}\n", t, 1e3 * on_surface.x,
                       1e3 * on_surface.y, 1e3 * on_surface.z, force.x, force.y, force.z);
    in += fmt::format("{:.4f},{:.17g},{:.17g},{:.17g}\n", t, 1e3 * below.x, 1e3 * below.y, 1e3 * below.z);
  }
  const auto result = hybrid::compare_measured(
      scene(), {.measured = {.file = write("raw.csv", raw)}, .along = write("in.csv", in)}, {});
  EXPECT_LT(result.rms_N, 1e-6);
  EXPECT_GT(compared(write("raw.csv", raw)).rms_N, 0.1) << "on the surface itself nothing presses";
}

// A measurement with a rate other than the scene's, and with a gap. Ticks in the gap are not compared.
TEST_F(CompareMeasured, AnyRateAndGaps) {
  std::string text = "t_s,x_mm,y_mm,z_mm,fx_N,fy_N,fz_N\n";
  for (int i = 0; i <= 480; ++i) {
    if (i > 200 && i < 280) continue;
    const double t = i / 240.0;
    const glm::dvec3 p = 1e3 * position(t), f = answer(position(t));
    text += fmt::format("{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g}\n", t, p.x, p.y, p.z, f.x,
                        f.y, f.z);
  }
  const auto result = compared(write("240hz.csv", text));
  EXPECT_NEAR(static_cast<double>(result.in_gaps), 80.0 / 240.0 * 1000.0, 2.0);
  EXPECT_EQ(result.samples + result.in_gaps, 2001U);
  // Position and force are both linear between samples, which are 4 ms apart. The remaining difference comes
  // from the curvature of the ball and from the beginning of contact. The path's own error is smaller: a t²/2
  // with a = 0.24 m/s² and t = 2 ms is 0.5 um, or 0.3 mN.
  EXPECT_LT(result.rms_N, 5e-3);
  EXPECT_EQ(result.notes.size(), 1U);
  EXPECT_THAT(result.notes[0], testing::HasSubstr("1 gap"));
}

// A recorded handover of a hand-held object. The tool touches nothing in the scene, so the error is the
// measured force.
TEST_F(CompareMeasured, ARealWrenchIsRead) {
  const auto folder = tests::shared_data("data/trajectories");
  SKIP_WITHOUT(folder);
  device::MeasuredFile file{.file = folder / "handover_baton_pose_wrench_120hz.csv.gz", .force = "giver"};
  const auto measured = device::read_measured(file);
  double sum2 = 0.0;
  for (const glm::dvec3& f : measured.force_N) sum2 += glm::dot(f, f);
  EXPECT_EQ(measured.t_s.size(), 801U);
  const auto result = hybrid::compare_measured(scene(), {.measured = file, .along = {}}, {});
  EXPECT_NEAR(result.rms_N, std::sqrt(sum2 / 801.0), 0.01);
  EXPECT_GT(result.rms_N, 5.0);
}

}  // namespace
