// SPDX-License-Identifier: GPL-3.0-or-later
// The live reference, against the same path played slowly.
#include "hybrid/reference/live_reference.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>
#include <vector>

#include "hybrid/feel/just_noticeable.h"
#include "hybrid/tick/copy_state.h"
#include "tests/hybrid/fixtures/touch.h"

namespace {

class LiveReferenceOf : public tests::SceneFile {};

// Tissue beside a rigid ball. Its links reach their limits.
const std::string kScene =
    "format = 1\n[material.fat]\nyoung = 3000\npoisson = 0.3\nstretch = [0.7, 1.4]\nshear = 0.4\n"
    "[[soft]]\nname = \"block\"\nformula = \"block\"\nsize = [60, 60, 40]\nspacing = 2\nmaterial = \"fat\"\n"
    "anchors = { faces = [\"-z\"] }\n"
    "[[rigid]]\nname = \"ball\"\nprimitive = \"ball\"\nradius = 10\nposition = [45, 0, 20]\n"
    "[tool]\nradius = 8\n" +
    tests::unlimited + tests::some_path;

// Device positions (m): a press, a slide towards the ball, a stop, and the way back.
std::vector<glm::dvec3> path(double speed_m_per_s) {
  const std::vector<glm::dvec3> corners{{0.0, 0.0, 0.03},     {0.0, 0.0, 0.022},    {0.012, 0.0, 0.022},
                                        {0.012, 0.006, 0.02}, {0.012, 0.006, 0.02}, {0.012, 0.006, 0.033}};
  std::vector<glm::dvec3> at;
  for (std::size_t n = 1; n < corners.size(); ++n) {
    const double way_m = glm::distance(corners[n], corners[n - 1]);
    const int ticks = way_m > 0.0 ? static_cast<int>(way_m / (1e-3 * speed_m_per_s)) : 100;
    for (int t = 1; t <= ticks; ++t)
      at.push_back(glm::mix(corners[n - 1], corners[n], t / static_cast<double>(ticks)));
  }
  return at;
}

std::vector<hybrid::PassedTick> play(tests::Touch& touch, const std::vector<glm::dvec3>& at) {
  std::vector<hybrid::PassedTick> passed;
  for (std::size_t n = 0; n < at.size(); ++n) {
    const hybrid::TickResult felt = touch.at(at[n]);
    passed.push_back({n, 1e-3 * static_cast<double>(n), felt.device_m, tests::coupling(felt),
                      glm::length(felt.soft_N) > 1e-9});
  }
  return passed;
}

double percentile_90(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() * 9 / 10];
}

// The live reference finds the error against the same path played ten times slower, within a factor of 2 and
// 0.1 JND, which no hand feels. This holds whether the reference answers often or rarely.
TEST_F(LiveReferenceOf, TissueFindsTheErrorOfASlowRun) {
  const hybrid::Scene scene = load(kScene);
  const std::vector<glm::dvec3> at = path(0.6);
  tests::Touch fast(scene, at.front()), slow(scene, at.front());
  ASSERT_EQ(hybrid::why_no_live_reference(fast.world(), fast.state()), "");
  const auto copy = [&] { return hybrid::copy_state(fast.world(), fast.state()); };
  auto often_begin = copy(), rarely_begin = copy();
  const std::vector<hybrid::PassedTick> passed = play(fast, at);
  std::vector<double> slow_jnd;
  glm::dvec3 from = at.front();
  for (std::size_t n = 0; n < at.size(); ++n) {
    constexpr int kParts = 10;
    hybrid::TickResult felt;
    for (int p = 1; p <= kParts; ++p)
      felt = slow.at(glm::mix(from, at[n], p / static_cast<double>(kParts)), 1e-3 / kParts);
    from = at[n];
    slow_jnd.push_back(hybrid::jnd_of(passed[n].coupling_N, tests::coupling(felt), hybrid::kJndFloor_N));
  }
  for (const std::size_t ticks : {std::size_t{5}, std::size_t{15}}) {
    hybrid::ReferenceSession reference(fast.world(), std::move(ticks == 5 ? often_begin : rarely_begin), 1e-3,
                                       hybrid::kJndFloor_N);
    std::vector<double> found, truth;
    int asked = 0;
    for (std::size_t n = ticks; n <= passed.size(); n += ticks) {
      const auto answer = reference.follow(std::span(passed).subspan(n - ticks, ticks));
      asked += passed[n - 1].soft ? 1 : 0;
      if (!answer) continue;
      EXPECT_EQ(answer->t_s, passed[n - 1].t_s);
      found.push_back(answer->jnd());
      truth.push_back(slow_jnd[n - 1]);
    }
    EXPECT_GT(static_cast<double>(found.size()), 0.8 * asked);
    const double said = percentile_90(found), is = percentile_90(truth);
    EXPECT_GT(is, 0.1) << "the scene is meant to show an error";
    EXPECT_LT(said, 2.0 * is + 0.1) << ticks;
    EXPECT_GT(said, 0.5 * is - 0.1) << ticks;
  }
}

TEST_F(LiveReferenceOf, TissueTakesEdits) {
  const hybrid::Scene scene = load(kScene);
  const std::vector<glm::dvec3> at = path(0.4);
  tests::Touch touch(scene, at.front());
  auto begin = hybrid::copy_state(touch.world(), touch.state());
  hybrid::LiveReference reference(touch.world(), std::move(begin), 1e-3, hybrid::kJndFloor_N);
  const hybrid::Edit twice{
      .tick = 0, .object = 1, .quantity = hybrid::EditedQuantity::tissue_factor, .value = 2.0};
  ASSERT_TRUE(hybrid::apply_edit(touch.world(), touch.state(), twice));
  reference.edited(twice);
  // Plays the path up to the stop. The tool then stays until an answer says that the force is that at rest.
  std::vector<hybrid::PassedTick> passed = play(touch, {at.begin(), at.end() - 30});
  for (const hybrid::PassedTick& tick : passed) reference.passed(tick);
  hybrid::PassedTick last = passed.back();
  hybrid::ForceAtRest found;
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  bool rests = false;
  while (!rests && std::chrono::steady_clock::now() < until) {
    ++last.tick;
    last.t_s += 1e-3;
    last.coupling_N = tests::coupling(touch.at(last.device_m));
    reference.passed(last);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    while (reference.found().pop(found)) rests = found.t_s > passed.back().t_s && found.jnd() < 0.1;
  }
  EXPECT_TRUE(rests) << found.jnd();
  EXPECT_GT(glm::length(found.at_rest_N), 0.1);
}

TEST_F(LiveReferenceOf, ScenesThatNeverRestAreRefused) {
  const auto why = [&](const std::string& text) {
    const tests::Touch touch(load(text), {0.0, 0.0, 0.03});
    return hybrid::why_no_live_reference(*touch.built.world, *touch.built.state);
  };
  EXPECT_NE(why("format = 1\n[[rigid]]\nname = \"ball\"\nprimitive = \"ball\"\nradius = 10\n" +
                tests::unlimited + tests::some_path),
            "");
  EXPECT_NE(why(kScene + "[[rigid]]\nname = \"b\"\nprimitive = \"ball\"\nradius = 5\nposition = [0, 0, 60]\n"
                         "motion = \"free\"\ndensity = 1000\n"),
            "");
}

}  // namespace
