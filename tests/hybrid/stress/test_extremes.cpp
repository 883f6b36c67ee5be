// SPDX-License-Identifier: GPL-3.0-or-later
// A part of the suite of extremes, and some fuzzed ticks. `hybrid stability SCENE --extremes --fuzz-ticks
// 1000000` runs the whole suite and a million ticks. Here HYBRID_FUZZ_TICKS sets the number of ticks.
#include <gtest/gtest.h>

#include <cstdlib>
#include <limits>
#include <set>
#include <string>

#include "hybrid/stress/extremes.h"
#include "hybrid/stress/fuzz_ticks.h"
#include "tests/hybrid/fixtures/touch.h"

namespace {

using tests::Touch;

TEST(Extremes, AShareOfTheTable) {
  std::set<std::string> oracles;
  std::size_t refused = 0;
  for (const hybrid::ExtremeRow& row : hybrid::run_extremes({.quick = true})) {
    EXPECT_TRUE(row.ok) << row.test_case << " | " << row.setting << " | " << row.oracle << ": "
                        << row.outcome;
    oracles.insert(row.oracle);
    refused += row.oracle == "refused" ? 1 : 0;
  }
  EXPECT_EQ(oracles, (std::set<std::string>{"energy", "finite", "hash", "held", "limits", "outside",
                                            "passive", "refused", "same", "settled", "time"}));
  EXPECT_GE(refused, 60U);
}

TEST(FuzzedTicks, HoldEveryOracle) {
  hybrid::FuzzOptions options;
  if (const char* ticks = std::getenv("HYBRID_FUZZ_TICKS")) options.ticks = std::strtoull(ticks, nullptr, 10);
  std::uint64_t ticks = 0;
  for (const hybrid::FuzzResult& r : hybrid::fuzz_ticks(options)) {
    for (const std::string& failure : r.failures) ADD_FAILURE() << failure;
    EXPECT_GT(r.contact_ticks, r.ticks / 20) << r.scene << ": it is meant to touch something";
    EXPECT_GT(r.nonfinite, 0U) << r.scene;
    ticks += r.ticks;
  }
  EXPECT_GE(ticks, options.ticks);
}

TEST(FuzzedTicks, TheSameSeedGivesTheSameBits) {
  hybrid::FuzzOptions options;
  options.ticks = 2000;
  options.seed = 7;
  options.only = "mixed";
  const std::vector<hybrid::FuzzResult> a = hybrid::fuzz_ticks(options), b = hybrid::fuzz_ticks(options);
  ASSERT_EQ(a.size(), 1U);
  ASSERT_EQ(b.size(), 1U);
  EXPECT_EQ(a[0].hash, b[0].hash);
}

class AnyInput : public tests::SceneFile {
 protected:
  hybrid::Scene mixed() const {
    return load("format = 1\n" + tests::block + tests::ball + "position = [0, 0, 7]\n" + tests::some_path +
                "[safety]\nsoft_start = 0\n");
  }
  static constexpr double kNan = std::numeric_limits<double>::quiet_NaN(),
                          kInf = std::numeric_limits<double>::infinity();
};

// A tick whose length is 0, negative or not finite does not change the clock.
TEST_F(AnyInput, NoTimeIsNoTime) {
  Touch touch(mixed(), {0, 0, 0.05});
  touch.at({0.005, 0, 0.009});
  const double now_s = touch.state().clock.now_s();
  for (const double dt : {0.0, -1.0, kNan, kInf, -kInf}) {
    const hybrid::TickResult felt = touch.at({0.005, 0, 0.009}, dt);
    EXPECT_TRUE(tests::finite(felt.force_N));
    EXPECT_EQ(touch.state().clock.now_s(), now_s) << dt;
  }
  EXPECT_EQ(touch.state().nonfinite, 0U);
}

TEST_F(AnyInput, TheLastGoodPlaceHolds) {
  Touch touch(mixed(), {0, 0, 0.05});
  const glm::dvec3 good(0.005, 0, 0.009);
  touch.go(good, 1e-3, 200);
  const hybrid::TickResult before = touch.at(good);
  std::uint64_t bad = 0;
  for (const double x : {kNan, kInf, -kInf, 1e300, -1e300, 2e12}) {
    for (int d = 0; d < 3; ++d) {
      glm::dvec3 p = good;
      p[d] = x;
      const hybrid::TickResult felt = touch.at(p);
      EXPECT_EQ(felt.device_m, good);
      EXPECT_NEAR(glm::length(felt.force_N - before.force_N), 0.0, 1e-3 * glm::length(before.force_N));
      EXPECT_EQ(touch.state().nonfinite, ++bad);
    }
  }
  EXPECT_EQ(touch.state().faults, hybrid::fault_nonfinite_input);
}

// However late the session's clock is, the felt force is the same to the bit. The rate is 1,024 ticks per
// second, so that every time is exact.
class Late : public tests::SceneFile {
 protected:
  std::uint64_t hash(const std::string& text, std::uint64_t start_ticks) const {
    const hybrid::Scene scene = load(text);
    hybrid::BuiltScene built = hybrid::build_scene(scene);
    hybrid::SessionOptions options;
    options.seconds = 1.0;
    options.keep_rows = false;
    options.start_ticks = start_ticks;
    const hybrid::SessionResult result = hybrid::run_session(scene, built, options);
    EXPECT_GT(result.contact_ticks, 200U);
    return result.state_hash;
  }
  static constexpr std::uint64_t kDay = 86'400ULL * 1024, kWrap = (1ULL << 32) - 1000;
};

TEST_F(Late, TheSameIsFelt) {
  const std::string start = "format = 1\n[device]\nrate = 1024\n[safety]\nsoft_start = 0\n";
  const std::string press =
      "[path]\nkind = \"press\"\nfrom = [6, 1, 14]\nto = [6, 1, 5]\nspeed = 30\nrepeat = 5\n";
  const std::string mixed = start + tests::block + tests::ball + "position = [0, 0, 7]\n" + press;
  const std::string rigid = start + tests::ball + "friction = 0.4\ndamping = 2\n" +
                            "[path]\nkind = \"press\"\nfrom = [1, 1, 14]\nto = [2, 1, 4]\nrepeat = 5\n";
  for (const std::string& text : {mixed, rigid}) {
    const std::uint64_t early = hash(text, 0);
    EXPECT_EQ(hash(text, kDay), early);
    EXPECT_EQ(hash(text, kWrap), early);
  }
}

TEST(Clock, IsTheTimeAfterSoManySteps) {
  device::Clock clock, late(86'400.0);
  double sum = 0.0;
  for (int n = 0; n < 10'000'000; ++n) {
    clock.add(1e-3);
    late.add(1e-3);
    sum += 1e-3;
  }
  EXPECT_EQ(clock.now_s(), 10'000.0);
  EXPECT_EQ(late.now_s(), 96'400.0);
  EXPECT_GT(std::abs(sum - 10'000.0), 1e-7) << "a plain sum drifts";
}

TEST(LatencyHistogram, IsNearTheListOfAll) {
  hybrid::LatencyHistogram spread;
  std::vector<double> all;
  for (int n = 1; n <= 20'000; ++n) {
    const double time_us = 0.05 * std::exp(1e-3 * ((n * 7919) % 20'000));
    spread.add(time_us);
    all.push_back(time_us);
  }
  const hybrid::Percentiles exact = hybrid::percentiles(all), kept = spread.percentiles();
  EXPECT_NEAR(kept.p50 / exact.p50, 1.0, 0.008);
  EXPECT_NEAR(kept.p99 / exact.p99, 1.0, 0.008);
  EXPECT_NEAR(kept.p999 / exact.p999, 1.0, 0.008);
  EXPECT_EQ(kept.max, exact.max);
}

}  // namespace
