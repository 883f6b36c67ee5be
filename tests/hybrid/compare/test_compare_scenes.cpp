// SPDX-License-Identifier: GPL-3.0-or-later
// Whole scenes along the same motion. Their differences follow from elasticity and geometry.
#include "hybrid/compare/compare_scenes.h"

#include <gmock/gmock.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "hybrid/feel/just_noticeable.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"

namespace {

using hybrid::ComparedScene;
using hybrid::ScenesComparison;
using testing::HasSubstr;

constexpr double kCoupling_N_per_m = 1500.0, kPressed_m = 3e-3;

class CompareScenes : public tests::SceneFile {
 protected:
  // A block of gel with its top at z = 5 mm. The path presses a ball of 4 mm into it by kPressed_m.
  hybrid::Scene gel(const std::string& name, const std::string& young, const std::string& spacing,
                    const std::string& tool = "shape = \"ball\"\nradius = 4\n",
                    const std::string& to = "[0, 0, 6]") const {
    return hybrid::load_scene(write(
        name, "format = 1\n[tool]\nstiffness = 1500\n" + tool + "[material.gel]\nyoung = " + young +
                  "\npoisson = 0.3\n[[soft]]\nname = \"block\"\nformula = \"block\"\nsize = [24, 24, 10]\n"
                  "spacing = " +
                  spacing + "\nmaterial = \"gel\"\nanchors = { faces = [\"-z\"] }\n" +
                  "[path]\nkind = \"press\"\nfrom = [0, 0, 12]\nto = " + to + "\nhold = 0.4\n"));
  }
  hybrid::Scene ball(const std::string& name, const std::string& radius) const {
    return hybrid::load_scene(write(name,
                                    "format = 1\n[tool]\nradius = 5\n[[rigid]]\nname = \"ball\"\n"
                                    "primitive = \"ball\"\nradius = " +
                                        radius +
                                        "\n[path]\nkind = \"press\"\nfrom = [0, 0, 30]\n"
                                        "to = [0, 0, 20]\nspeed = 50\nhold = 0.2\n"));
  }
};

// Force in the last tick in which the device is at its lowest place (N).
double held_N(const ComparedScene& scene) {
  double deepest = 1.0, force = 0.0;
  for (const auto& row : scene.rows) {
    if (row.device_m.z > deepest + 1e-9) continue;
    deepest = std::min(deepest, row.device_m.z);
    force = glm::length(row.force_N);
  }
  return force;
}

// Force (N) of tissue in series with the coupling, if the tissue is twice as stiff as tissue that gives
// `force_N`. The tissue's force is a power law of the depth.
double of_twice_the_stiffness(double force_N, double power) {
  const double depth_m = kPressed_m - force_N / kCoupling_N_per_m;
  double low = 0.0, high = 2.0 * force_N;
  for (int n = 0; n < 60; ++n) {
    const double middle = 0.5 * (low + high);
    const double there = kPressed_m - middle / kCoupling_N_per_m;
    const double tissue = there > 0.0 ? 2.0 * force_N * std::pow(there / depth_m, power) : 0.0;
    (tissue > middle ? low : high) = middle;
  }
  return low;
}

TEST_F(CompareScenes, ASceneCannotBeToldFromItself) {
  const auto one = gel("a.toml", "8000", "2");
  const ScenesComparison c = hybrid::compare_scenes(std::vector{one, one}, true, {});
  ASSERT_EQ(c.scenes.size(), 2U);
  EXPECT_NE(c.scenes[0].name, c.scenes[1].name);
  EXPECT_TRUE(c.notes.empty());
  for (const ComparedScene& scene : c.scenes) {
    EXPECT_GT(scene.all.ticks, 400U);
    EXPECT_EQ(scene.all.ticks, scene.moving.ticks + scene.still.ticks);
    EXPECT_GT(scene.still.ticks, 300U);  // the path has a hold of 0.4 s
    EXPECT_EQ(scene.all.max_jnd, 0.0);
    EXPECT_EQ(scene.direction_p99_deg.value_or(-1.0), 0.0);
    EXPECT_EQ(scene.onset_later_s.value_or(-1.0), 0.0);
    EXPECT_GT(scene.own_error.all.samples, 0);
    EXPECT_GT(scene.tick_us.p50, 0.0);
  }
  EXPECT_THAT(hybrid::verdict(c, 1), HasSubstr("cannot be told apart"));
}

TEST_F(CompareScenes, TwiceTheModulusIsFeltAsElasticitySays) {
  const std::vector scenes{gel("soft.toml", "8000", "2"), gel("stiff.toml", "16000", "2")};
  const ScenesComparison c = hybrid::compare_scenes(scenes, false, {});
  const double soft_N = held_N(c.scenes[0]), stiff_N = held_N(c.scenes[1]);
  ASSERT_GT(soft_N, 0.1);
  // The force lies between that of a flat contact (power 1) and of one that stiffens more than Hertz's (power
  // 2).
  EXPECT_GT(stiff_N, 0.98 * of_twice_the_stiffness(soft_N, 2.0));
  EXPECT_LT(stiff_N, 1.02 * of_twice_the_stiffness(soft_N, 1.0));
  const double jnd = (stiff_N - soft_N) / std::max(hybrid::kJndShare * soft_N, hybrid::kJndFloor_N);
  EXPECT_GE(c.scenes[1].still.max_jnd, 0.99 * jnd);
  EXPECT_NEAR(c.scenes[1].still.p50_jnd, jnd, 0.1 * jnd);
  EXPECT_EQ(c.scenes[0].soft_voxels, c.scenes[1].soft_voxels);
  EXPECT_EQ(c.scenes[0].own_error.all.samples, 0);
  EXPECT_THAT(hybrid::verdict(c, 1), HasSubstr("stiff can be told from soft"));
  std::printf("twice the modulus: %.3f N, then %.3f N; by a power law 2: %.3f, 1: %.3f\n", soft_N, stiff_N,
              of_twice_the_stiffness(soft_N, 2.0), of_twice_the_stiffness(soft_N, 1.0));
}

TEST_F(CompareScenes, HalfTheSpacingIsEightTimesTheVoxelsAndAboutTheForce) {
  const std::vector scenes{gel("coarse.toml", "8000", "2"), gel("fine.toml", "8000", "1")};
  const ScenesComparison c = hybrid::compare_scenes(scenes, false, {});
  EXPECT_EQ(c.scenes[1].soft_voxels, 8 * c.scenes[0].soft_voxels);
  EXPECT_GT(c.scenes[1].memory_bytes, c.scenes[0].memory_bytes);
  const double coarse_N = held_N(c.scenes[0]), fine_N = held_N(c.scenes[1]);
  EXPECT_GT(c.scenes[1].all.max_jnd, 0.0);
  EXPECT_NEAR(fine_N, coarse_N, 0.25 * coarse_N);  // the contact is only four voxels wide
  std::printf("half the spacing: %.3f N, then %.3f N\n", coarse_N, fine_N);
}

TEST_F(CompareScenes, ALowerSurfaceIsFeltLaterByTheTimeToGetThere) {
  const std::vector scenes{ball("high.toml", "20"), ball("low.toml", "19")};
  const ScenesComparison c = hybrid::compare_scenes(scenes, true, {});
  ASSERT_TRUE(c.scenes[1].onset_later_s.has_value());
  EXPECT_NEAR(*c.scenes[1].onset_later_s, 1e-3 / 0.05,
              1.01e-3);  // the time for 1 mm at 50 mm/s, within a tick
  EXPECT_NEAR(c.scenes[0].peak_N - c.scenes[1].peak_N, 1.0, 0.02);  // 1 mm less depth at 1,000 N/m
  EXPECT_LT(c.scenes[1].direction_p99_deg.value_or(90.0), 3.0);
  EXPECT_EQ(c.scenes[1].soft_voxels, 0U);
}

TEST_F(CompareScenes, AnotherToolIsRefusedAndAnotherPathIsSaid) {
  const auto one = gel("a.toml", "8000", "2");
  const auto refusal = [&](const hybrid::Scene& other) -> std::string {
    try {
      (void)hybrid::compare_scenes(std::vector{one, other}, false, {});
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(refusal(gel("b.toml", "8000", "2", "shape = \"ball\"\nradius = 5\n")),
              HasSubstr("a ball of radius 5 mm"));
  EXPECT_THAT(refusal(gel("b.toml", "8000", "2", "shape = \"punch\"\nradius = 4\n")),
              HasSubstr("a punch of radius 4 mm"));
  auto faster = one;
  faster.rate_hz = 2000.0;
  EXPECT_THAT(refusal(faster), HasSubstr("2000 Hz"));

  try {
    (void)hybrid::compare_scenes(std::vector{ball("small.toml", "20"), ball("large.toml", "40")}, false, {});
    ADD_FAILURE() << "the path of the first begins inside the second's ball";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("large.toml"));
    EXPECT_THAT(error.what(), HasSubstr("the path of small, the first scene"));
  }

  const auto deeper = gel("deeper.toml", "8000", "2", "shape = \"ball\"\nradius = 4\n", "[0, 0, 5]");
  const ScenesComparison c = hybrid::compare_scenes(std::vector{one, deeper}, false, {});
  ASSERT_EQ(c.notes.size(), 1U);
  EXPECT_THAT(c.notes.front(), HasSubstr("deeper has another path"));
  EXPECT_EQ(c.scenes[1].all.max_jnd, 0.0);  // both scenes play the path of the first
}

}  // namespace
