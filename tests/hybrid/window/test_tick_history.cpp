// SPDX-License-Identifier: GPL-3.0-or-later
// The history behind the charts: a short spike appears in the columns at any frame rate and any width.
#include "hybrid/window/tick_history.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "hybrid/window/watched_numbers.h"

namespace {

using hybrid::ForceSeries;

constexpr double kTick_s = 1e-3;

hybrid::TickSample sample(int tick, float total_N) {
  return {
      .t_s = tick * kTick_s, .total_N = total_N, .rigid_N = 0.5F * total_N, .soft_N = 0.0F, .tick_us = 50.0F};
}

float most_in(const hybrid::TickHistory& history, ForceSeries series, std::size_t count) {
  float most = 0.0F;
  for (const auto& column : history.columns(series, count))
    most = std::max(most, column ? column->most_N : 0.0F);
  return most;
}

// The servo loop fills the ring, and the window empties it once a frame.
TEST(TickHistory, ASpikeOfTwoTicksIsInTheColumnsAtAnyFrameRate) {
  for (const int ticks_a_frame : {1, 7, 16, 17, 100, 900}) {
    for (const std::size_t width : {std::size_t{1}, std::size_t{40}, std::size_t{333}, std::size_t{5000}}) {
      hybrid::TickSamples ring(1000);
      hybrid::TickHistory history(5.0);
      for (int tick = 0; tick < 4000; ++tick) {
        const bool spike = tick == 2500 || tick == 2501;
        ASSERT_TRUE(ring.push(sample(tick, spike ? 6.0F : 1.0F)));
        hybrid::TickSample taken;
        if (tick % ticks_a_frame == ticks_a_frame - 1)
          while (ring.pop(taken)) history.add(taken);
      }
      hybrid::TickSample taken;
      while (ring.pop(taken)) history.add(taken);
      EXPECT_EQ(most_in(history, ForceSeries::total, width), 6.0F) << ticks_a_frame << ", " << width;
      EXPECT_EQ(most_in(history, ForceSeries::rigid, width), 3.0F);
      // At most two columns show the spike.
      const auto columns = history.columns(ForceSeries::total, width);
      const auto high =
          std::count_if(columns.begin(), columns.end(), [](const auto& c) { return c && c->most_N > 1.0F; });
      EXPECT_LE(high, 2);
      if (width > 2) {
        EXPECT_EQ(columns.back()->least_N, 1.0F);
      }
    }
  }
}

TEST(TickHistory, ThePathOfTheHandEndsWhereTheHandIs) {
  hybrid::TickHistory history(2.0);
  EXPECT_TRUE(history.path_m(100).empty());
  for (int tick = 0; tick < 5000; ++tick) {
    hybrid::TickSample now = sample(tick, 0.0F);
    now.device_m = {1e-3 * tick, 0.0, 0.0};
    history.add(now);
  }
  const std::vector<glm::dvec3> path = history.path_m(100);
  EXPECT_LE(path.size(), 102U);
  EXPECT_GE(path.size(), 90U);
  EXPECT_NEAR(path.front().x, 3.0, 0.01) << "two seconds ago";
  EXPECT_EQ(path.back().x, 1e-3 * 4999);
  for (std::size_t n = 1; n < path.size(); ++n) EXPECT_GT(path[n].x, path[n - 1].x - 1e-12);
}

TEST(TickHistory, EveryPartHasItsSeries) {
  hybrid::TickHistory history(5.0);
  hybrid::TickSample one{.t_s = 1.0,
                         .total_N = 1.0F,
                         .rigid_N = 2.0F,
                         .soft_N = 3.0F,
                         .friction_N = 4.0F,
                         .damping_N = 5.0F,
                         .limits_N = 6.0F,
                         .passivity_N = 7.0F};
  history.add(one);
  for (std::size_t s = 0; s < hybrid::kForceSeries; ++s) {
    const auto series = static_cast<ForceSeries>(s);
    EXPECT_EQ(history.most_N(series), static_cast<double>(s + 1));
    EXPECT_EQ(most_in(history, series, 10), static_cast<float>(s + 1));
  }
  EXPECT_EQ(history.most_N(), 7.0);
}

TEST(TickHistory, PartsAreThoseOfTheTickWithTheLargestForce) {
  hybrid::TickHistory history(5.0);
  for (int tick = 0; tick < 1000; ++tick) {
    hybrid::TickSample one = sample(tick, tick == 500 ? 4.0F : 1.0F);
    one.along_N = {0.75F * one.total_N, 0.5F * one.total_N, 0.0F, 0.0F, -0.25F * one.total_N, 0.0F};
    history.add(one);
  }
  for (const std::size_t count : {std::size_t{1}, std::size_t{37}, std::size_t{5000}}) {
    std::size_t spikes = 0, seen = 0;
    for (const auto& parts : history.parts(count)) {
      if (!parts) continue;
      ++seen;
      float sum = 0.0F;
      for (const float part : *parts) sum += part;
      spikes += sum == 4.0F ? 1 : 0;
      EXPECT_TRUE(sum == 1.0F || sum == 4.0F);
    }
    EXPECT_EQ(spikes, 1U) << count;
    EXPECT_GT(seen, 0U);
  }
}

TEST(TickHistory, EveryNumberOfATickHasItsRange) {
  hybrid::TickHistory history(5.0);
  const hybrid::WatchedNumber* const force = hybrid::watched_number_named("force");
  const hybrid::WatchedNumber* const apart = hybrid::watched_number_named("device to proxy");
  ASSERT_TRUE(force != nullptr && apart != nullptr);
  EXPECT_EQ(hybrid::watched_number_named("farce"), nullptr);
  EXPECT_FALSE(history.range(force->of));
  for (int tick = 0; tick < 100; ++tick) {
    hybrid::TickSample one = sample(tick, tick == 50 ? 6.0F : 1.0F);
    one.device_m = {0.0, 0.0, -1e-5 * tick};
    history.add(one);
  }
  EXPECT_EQ(history.range(force->of)->most, 6.0);
  EXPECT_EQ(history.range(force->of)->now, 1.0);
  EXPECT_EQ(apart->unit, "mm");
  EXPECT_NEAR(history.range(apart->of)->now, 0.99, 1e-9);
  EXPECT_EQ(history.range(apart->of)->least, 0.0);
  for (const hybrid::WatchedNumber& number : hybrid::watched_numbers()) {
    EXPECT_TRUE(history.range(number.of)) << number.name;
    EXPECT_EQ(hybrid::watched_number_named(number.name), &number) << "names differ";
  }
}

TEST(TickHistory, AFullRingRefusesAndCountsAndDoesNotWait) {
  hybrid::TickSamples ring(100);
  for (int tick = 0; tick < 250; ++tick) ring.push(sample(tick, 1.0F));
  EXPECT_EQ(ring.refused(), 150U);
}

TEST(TickHistory, KeepsItsSecondsAndBeginsAnew) {
  hybrid::TickHistory history(0.9995);
  for (int tick = 0; tick < 5000; ++tick) history.add(sample(tick, 1.0F));
  EXPECT_EQ(history.times().ticks, 1000U);
  EXPECT_DOUBLE_EQ(history.end_s(), 4.999);
  history.add(sample(10, 2.0F));
  EXPECT_EQ(history.times().ticks, 1U);
  history.add(sample(11, NAN));
  EXPECT_EQ(most_in(history, ForceSeries::total, 10), 2.0F);
}

TEST(TickHistory, TimesAreThoseOfASortedList) {
  hybrid::TickHistory history(10.0);
  for (int tick = 0; tick < 1000; ++tick) {
    hybrid::TickSample one = sample(tick, 1.0F);
    one.tick_us = static_cast<float>(1 + tick);
    one.stage_us[2] = 30.0F;
    one.late = tick % 100 == 0;
    history.add(one);
  }
  const hybrid::TickTimes times = history.times();
  EXPECT_NEAR(times.p50_us, 501.0, 1.0);
  EXPECT_NEAR(times.p99_us, 991.0, 1.0);
  EXPECT_EQ(times.most_us, 1000.0);
  EXPECT_EQ(times.late, 10U);
  EXPECT_DOUBLE_EQ(times.stage_us[2], 30.0);
  std::uint64_t in_bins = 0;
  for (const std::uint64_t bin : times.bins) in_bins += bin;
  EXPECT_EQ(in_bins, 1000U);
  EXPECT_EQ(hybrid::TickTimes::bin_of(0.0), 0U);
  EXPECT_EQ(hybrid::TickTimes::bin_of(1e9), hybrid::TickTimes::kBins - 1);
}

TEST(TickHistory, AMarkSeparatesTheTicksBeforeAChangeFromThoseAfterIt) {
  hybrid::TickHistory history(5.0);
  for (int tick = 0; tick < 1000; ++tick) history.add(sample(tick, tick == 10 ? 6.0F : 1.0F));
  history.mark(1000 * kTick_s);
  for (int tick = 1000; tick < 1500; ++tick) {
    auto after = sample(tick, 2.0F);
    after.tick_us = 20.0F;
    history.add(after);
  }
  ASSERT_TRUE(history.last_change());
  EXPECT_EQ(history.last_change()->before.ticks, 1000U);
  EXPECT_EQ(history.last_change()->before.p50_us, 50.0);
  EXPECT_EQ(history.last_change()->most_before_N, 6.0);
  const double from = history.last_change()->t_s;
  EXPECT_EQ(history.times(from, 1e9).ticks, 500U);
  EXPECT_EQ(history.times(from, 1e9).p99_us, 20.0);
  EXPECT_EQ(history.most_N(ForceSeries::total, from, 1e9), 2.0);
  history.mark(1500 * kTick_s);
  EXPECT_EQ(history.last_change()->before.ticks, 500U) << "ticks before an earlier mark do not count";
  history.add(sample(3, 1.0F));
  EXPECT_FALSE(history.last_change()) << "a new session begins";
}

}  // namespace
