// SPDX-License-Identifier: GPL-3.0-or-later
// The parts of the thesis's study, and its report. Times are not tested here.
#include "hybrid/bench/thesis/thesis_study.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "hybrid/session/session.h"

namespace {

using hybrid::bench::LargestCube;
using hybrid::bench::SoftEngine;
using hybrid::bench::ThesisStudy;
using hybrid::bench::Vigour;
using testing::HasSubstr;

constexpr double kShort_s = 0.1;

TEST(ThesisStudy, TheLargestCubeInTimeIsFoundWhereverItIs) {
  const std::vector<int> edges{8, 10, 13, 16, 20, 25, 32};
  for (int most = 0; most <= 40; ++most) {
    int tried = 0;
    const auto found = hybrid::bench::largest_in_time(edges, [&](int edge) {
      ++tried;
      return edge <= most;
    });
    const auto fit = std::ranges::count_if(edges, [most](int edge) { return edge <= most; });
    ASSERT_EQ(found.has_value(), fit > 0) << most;
    if (found) {
      EXPECT_EQ(*found, static_cast<std::size_t>(fit) - 1) << most;
    }
    EXPECT_LE(tried, 5);
  }
  EXPECT_FALSE(hybrid::bench::largest_in_time({}, [](int) { return true; }));
}

// Both halves of the pair are one block.
TEST(ThesisStudy, ThePairIsOneBlockUnderOneHand) {
  const Vigour& hand = hybrid::bench::vigours().back();
  constexpr int kEdge = 12;
  const hybrid::bench::CubeMeshFile file(kEdge, 1200);
  EXPECT_EQ(file.triangles(), 1200U);
  const hybrid::Scene cube = hybrid::bench::study_cube(kEdge, hand, kShort_s);
  const hybrid::Scene mesh = hybrid::bench::study_mesh(file, kEdge, hand, kShort_s);
  std::vector<std::uint64_t> touched;
  for (const hybrid::Scene* scene : {&cube, &mesh}) {
    hybrid::BuiltScene built = hybrid::build_scene(*scene);
    const auto felt =
        hybrid::run_session(*scene, built, {.seconds = kShort_s, .progress = {}, .async_relaxation = true});
    EXPECT_GT(felt.max_force_N, 0.0);
    EXPECT_EQ(built.state->faults, 0U);
    touched.push_back(felt.contact_ticks);
  }
  EXPECT_GT(touched[0], 20U);
  // Between two voxels the tool meets tissue up to half a spacing deeper, so contacts there are a little
  // shorter.
  EXPECT_GE(touched[1], touched[0]);
  EXPECT_LE(2 * touched[1], 3 * touched[0]);
  const auto classic = hybrid::bench::play_classic(cube, kShort_s);
  EXPECT_EQ(classic.ticks, 100U);
}

TEST(ThesisStudy, AFileOfTheMeshIsGoneAfterUse) {
  std::filesystem::path file;
  {
    const hybrid::bench::CubeMeshFile mesh(8, 300);
    file = mesh.file();
    EXPECT_TRUE(std::filesystem::exists(file));
  }
  EXPECT_FALSE(std::filesystem::exists(file));
}

TEST(ThesisStudy, SmallCubesAreNotPressedOntoTheirAnchors) {
  for (const int edge : {8, 16, 64}) {
    for (const Vigour& hand : hybrid::bench::vigours()) {
      const hybrid::Scene scene = hybrid::bench::study_cube(edge, hand, kShort_s);
      const auto path = hybrid::scene_path(scene);
      double lowest = 1.0;
      for (int t = 0; t < 100; ++t)
        lowest = std::min(lowest, path->position(1e-3 * t).z - scene.tool.radius_m);
      EXPECT_GT(lowest, -0.5e-3 * edge + 0.8e-3 * edge) << edge;
      EXPECT_LT(lowest, 0.5e-3 * edge) << edge;
    }
  }
}

ThesisStudy made_up() {
  ThesisStudy study;
  study.edges = {8, 16, 32};
  for (const SoftEngine engine : {SoftEngine::classic, SoftEngine::hybrid}) {
    for (const Vigour& hand : hybrid::bench::vigours()) {
      const bool ours = engine == SoftEngine::hybrid;
      LargestCube row{.engine = engine,
                      .vigour = hand,
                      .edge = ours ? 32 : 16,
                      .voxels = ours ? 32768U : 4096U,
                      .late_edge = ours ? 0 : 32,
                      .of_largest = {.ticks = 100, .tick_us = {}},
                      .error_jnd = {}};
      if (!ours && hand.name == "vigorous") row.edge = 0;
      study.cubes.push_back(row);
    }
  }
  study.pair.push_back({.model = "voxels",
                        .vigour = hybrid::bench::vigours()[1],
                        .elements = 24389,
                        .session = {.tick_us = {}},
                        .error_jnd = 0.2});
  study.threads = {{"windows", 3.0, {}, {}}, {"haptics", 4.0, 30.0, 60.0}};
  return study;
}

TEST(ThesisStudy, TheVerdictNamesBothEnginesAndWhatWasNotInTime) {
  const std::string verdict = hybrid::bench::thesis_verdict(made_up());
  EXPECT_THAT(verdict, HasSubstr("the thesis's algorithm serves 4,096 voxels under a gentle hand"));
  EXPECT_THAT(verdict, HasSubstr("no cube under a vigorous hand"));
  EXPECT_THAT(verdict, HasSubstr("hybrid serves every cube up to 32,768 voxels, however vigorous the hand"));
}

TEST(ThesisStudy, ThePageHasTheCurveOfBothEnginesAndThreeTables) {
  const hybrid::Page page = hybrid::bench::thesis_page(made_up());
  EXPECT_EQ(page.mark, hybrid::PageMark::good);
  const auto json = hybrid::page_json(page);
  ASSERT_EQ(json.at("tables").size(), 3U);
  EXPECT_EQ(json.at("tables")[0].at("rows").size(), 2 * hybrid::bench::vigours().size());
  const std::string html = hybrid::to_html(page);
  EXPECT_THAT(html, HasSubstr("the thesis&apos;s algorithm"));
  EXPECT_THAT(html, HasSubstr("24,000 voxels and 11,200 triangles"));
  EXPECT_EQ(hybrid::bench::to_json(made_up().threads[0]).at("ms_per_s"), nullptr);
}

}  // namespace
