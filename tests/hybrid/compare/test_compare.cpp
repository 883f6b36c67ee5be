// SPDX-License-Identifier: GPL-3.0-or-later
// Comparison of models, and calibration of tissue: the felt force at equilibrium against Hertz and the flat
// punch.
#include "hybrid/compare/compare.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/hybrid/fixtures/touch.h"

namespace {

using hybrid::Comparison;
using hybrid::ModelResult;

class Compare : public tests::SceneFile {};

const ModelResult* named(const Comparison& comparison, const std::string& name) {
  const auto at = std::find_if(comparison.models.begin(), comparison.models.end(),
                               [&](const ModelResult& m) { return m.name == name; });
  return at == comparison.models.end() ? nullptr : &*at;
}

double max_force(const ModelResult& model) {
  double most = 0.0;
  for (const auto& row : model.rows) most = std::max(most, glm::length(row.force_N));
  return most;
}

void expect_sane(const Comparison& c) {
  ASSERT_LT(c.reference, c.models.size());
  EXPECT_FALSE(c.reference_text.empty());
  EXPECT_GT(c.jnd_floor_N, 0.0);
  for (const ModelResult& m : c.models) {
    SCOPED_TRACE(m.name);
    ASSERT_FALSE(m.rows.empty());
    EXPECT_EQ(m.rows.size(), c.models.front().rows.size());
    EXPECT_TRUE(m.depth_m.empty() || m.depth_m.size() == m.rows.size());
    for (const double x : {m.rms_N, m.max_N, m.jnd_p50, m.jnd_p99, m.share_above_1_jnd, m.direction_p50_deg,
                           m.direction_p99_deg}) {
      EXPECT_TRUE(std::isfinite(x) && x >= 0.0);
    }
    EXPECT_TRUE(std::isfinite(m.work_J));
    EXPECT_LE(m.rms_N, m.max_N * (1.0 + 1e-12));
    EXPECT_LE(m.jnd_p50, m.jnd_p99);
    EXPECT_LE(m.share_above_1_jnd, 1.0);
    EXPECT_LE(m.direction_p50_deg, m.direction_p99_deg);
    for (std::size_t n = 0; n < m.rows.size(); ++n)
      ASSERT_EQ(m.rows[n].device_m, c.models.front().rows[n].device_m) << "the motion is the same";
  }
  EXPECT_EQ(c.models[c.reference].max_N, 0.0);
}

TEST_F(Compare, TheCubeAsProxyVoxelsAndHertz) {
  const auto scene = hybrid::load_scene(tests::source_folder / "scenes" / "cube.toml");
  const Comparison c = hybrid::compare_models(scene, "", {});
  EXPECT_EQ(c.object, "block");
  expect_sane(c);
  ASSERT_NE(named(c, "mesh and proxy"), nullptr);
  ASSERT_NE(named(c, "voxels"), nullptr);
  ASSERT_NE(named(c, "hertz"), nullptr);
  EXPECT_EQ(c.models[c.reference].name, "voxels");  // not Hertz, which ignores the core
  EXPECT_GT(max_force(*named(c, "mesh and proxy")), max_force(*named(c, "voxels")));
  ASSERT_NE(named(c, "classic"),
            nullptr);  // the thesis's model feels the block, but with a larger error than Hertz's law
  EXPECT_GT(max_force(*named(c, "classic")), 0.05);
  EXPECT_GT(named(c, "classic")->rms_N, named(c, "hertz")->rms_N);
}

TEST_F(Compare, ABallsProxyIsItsClosedFormWithinOnePercent) {
  const auto scene = load(
      "format = 1\n[tool]\nradius = 5\n[[rigid]]\nname = \"ball\"\nprimitive = \"ball\"\nradius = 20\n"
      "[path]\nkind = \"waypoints\"\nspeed = 50\npoints = [[0, 0, 40], [0, 0, 22, 0.2], [10, 0, 20], [20, 5, "
      "5], [40, 5, 0]]\n");
  const Comparison c = hybrid::compare_models(scene, "ball", {});
  expect_sane(c);
  const ModelResult* const proxy = named(c, "mesh and proxy");
  ASSERT_NE(proxy, nullptr);
  EXPECT_EQ(c.models[c.reference].name, "rigid closed form");
  const double most = max_force(c.models[c.reference]);
  EXPECT_GT(most, 2.0);
  // The ball is felt as a mesh. Its facets turn the force by up to half the angle between two facets, but
  // hardly change its magnitude.
  double size_error = 0.0;
  for (std::size_t n = 0; n < proxy->rows.size(); ++n) {
    const double size = glm::length(proxy->rows[n].force_N),
                 exact = glm::length(c.models[c.reference].rows[n].force_N);
    size_error = std::max(size_error, std::fabs(size - exact));
  }
  EXPECT_LE(size_error, 0.01 * most);
  EXPECT_LE(proxy->direction_p99_deg, 2.5);  // the angle that a finger joint can resolve
  std::printf("ball: of %.2f N, its mesh is off by %.2f %% in size and %.2f degrees in direction (p99)\n",
              most, 100.0 * size_error / most, proxy->direction_p99_deg);
}

TEST_F(Compare, AnObjectOnAPathIsFeltOnItInEveryModel) {
  // The ball moves from the left under a tool that goes down. It also turns about an axis beside it.
  const auto scene = load(
      "format = 1\n[tool]\nradius = 5\n[[rigid]]\nname = \"ball\"\nprimitive = \"ball\"\nradius = 20\n"
      "position = [-40, 0, 0]\nmotion = \"path\"\n[rigid.path]\nkind = \"waypoints\"\nspeed = 40\n"
      "points = [[0, 0, 0], [40, 5, 0]]\n[rigid.spin]\naxis = [0, 0, 1]\nabout = [-45, 0, 0]\nrate = 50\n"
      "[path]\nkind = \"waypoints\"\nspeed = 20\npoints = [[0, 0, 40], [0, 0, 22, 1.0], [0, 0, 40]]\n");
  const Comparison c = hybrid::compare_models(scene, "ball", {});
  expect_sane(c);
  EXPECT_EQ(named(c, "voxels"), nullptr);
  EXPECT_FALSE(c.note.empty()) << "it says that voxels do not move";
  const ModelResult *const proxy = named(c, "mesh and proxy"), *const nearest = named(c, "nearest-surface");
  ASSERT_NE(proxy, nullptr);
  ASSERT_NE(nearest, nullptr);
  EXPECT_EQ(c.models[c.reference].name, "rigid closed form");
  const double most = max_force(c.models[c.reference]);
  std::printf(
      "ball on a path: of %.2f N, proxy off by %.4f N (max) and %.2f degrees (p99), nearest surface by %.4f "
      "N\n",
      most, proxy->max_N, proxy->direction_p99_deg, nearest->max_N);
  EXPECT_GT(most, 1.0);
  EXPECT_LE(nearest->max_N, 0.05 * most);
  EXPECT_LE(proxy->max_N, 0.05 * most);
}

TEST_F(Compare, RefusesWhatIsPushedFreely) {
  const auto scene = load(
      "format = 1\n[[rigid]]\nname = \"puck\"\nprimitive = \"ball\"\nradius = 4\nmotion = \"free\"\n"
      "mass = 0.1\n" +
      tests::path);
  try {
    (void)hybrid::compare_models(scene, "puck", {});
    FAIL() << "not refused";
  } catch (const hybrid::SceneError& error) {
    const std::string what = error.what();
    EXPECT_NE(what.find("\"puck\""), std::string::npos) << what;
    EXPECT_NE(what.find("scene.toml:6"), std::string::npos) << what;
  }
}

TEST_F(Compare, RefusesAnObjectThatIsNotThere) {
  const auto scene = load("format = 1\n" + tests::ball + tests::path);
  try {
    (void)hybrid::compare_models(scene, "bell", {});
    FAIL() << "not refused";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("\"bell\""), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("\"ball\""), std::string::npos) << "it says which there are";
  }
}

// A block with a spacing of 1 mm. It is so wide and deep that its ends do not affect the contact.
class Calibration : public tests::SceneFile {
 protected:
  struct Felt {
    double force_N, indentation_m;
  };
  // Force and indentation at the end of a hold at `depth_mm`, from a whole session.
  Felt pressed(const std::string& tool, double depth_mm, double radius_mm, double stiffness) const {
    const double touched = 35.0 + (tool == "ball" ? radius_mm : 0.0);
    std::ostringstream text;
    text << "format = 1\n[tool]\nshape = \"" << tool << "\"\nradius = " << radius_mm
         << "\nstiffness = " << stiffness << "\n"
         << tests::unlimited << "[material.gel]\nyoung = 10000\npoisson = 0.3\n"
         << "[[soft]]\nname = \"block\"\nformula = \"block\"\nsize = [100, 100, 70]\nspacing = 1\nmaterial = "
            "\"gel\"\n"
         << "anchors = { faces = [\"-z\", \"-x\", \"+x\", \"-y\", \"+y\"] }\n"
         << "[path]\nkind = \"press\"\nfrom = [0, 0, " << touched + 1.0 << "]\nto = [0, 0, "
         << touched - depth_mm << "]\nspeed = 5\nhold = 2.5\n";
    const hybrid::Scene scene = load(text.str());
    auto built = hybrid::build_scene(scene);
    const double down_s = (1.0 + depth_mm) / 5.0;
    const auto result = hybrid::run_session(scene, built, {.seconds = down_s + 2.45, .progress = {}});
    const auto& last = result.rows.back();
    return {last.force_N.z, (touched - 1e3 * last.proxy_m.z) * 1e-3};
  }
  static constexpr double kModulus = 10'000.0 / (1.0 - 0.3 * 0.3);
};

TEST_F(Calibration, AFlatPunchFeelsTwoRadiiTimesTheModulus) {
  const double a = 4.5e-3, depth = 0.5e-3, coupling = 500.0;
  const Felt felt = pressed("punch", 1e3 * depth, 1e3 * a, coupling);
  const double k = 2.0 * a * kModulus;
  const double expected = depth * k * coupling / (k + coupling);
  std::printf("punch: %.5f N, closed form %.5f N (%+.1f %%); at its own indentation %+.1f %%\n", felt.force_N,
              expected, 100.0 * (felt.force_N / expected - 1.0),
              100.0 * (felt.force_N / (k * felt.indentation_m) - 1.0));
  EXPECT_NEAR(felt.force_N, expected, 0.1 * expected);
}

TEST_F(Calibration, ABallFeelsHertz) {
  const double radius = 16e-3, depth = 1.25e-3, coupling = 500.0;
  const Felt felt = pressed("ball", 1e3 * depth, 1e3 * radius, coupling);
  ASSERT_GE(std::sqrt(radius * felt.indentation_m), 4e-3);  // the contact radius is at least four spacings
  const auto hertz = [radius](double d) {
    return 4.0 / 3.0 * kModulus * std::sqrt(radius) * std::pow(d, 1.5);
  };
  double low = 0.0, high = depth;
  for (int n = 0; n < 60; ++n) {
    const double middle = 0.5 * (low + high);
    (hertz(middle) < coupling * (depth - middle) ? low : high) = middle;
  }
  const double expected = hertz(low);
  std::printf("ball: %.5f N, Hertz %.5f N (%+.1f %%); at its own indentation %+.1f %%\n", felt.force_N,
              expected, 100.0 * (felt.force_N / expected - 1.0),
              100.0 * (felt.force_N / hertz(felt.indentation_m) - 1.0));
  EXPECT_NEAR(felt.force_N, expected, 0.1 * expected);
}

}  // namespace
