// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/loop/servo_timer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <thread>

namespace {

using Clock = std::chrono::steady_clock;  // CLOCK_MONOTONIC
using device::ServoTimer;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// Only lower bounds on times are tested, because a loaded machine may wake a thread arbitrarily late. wait()
// reports the lateness.
TEST(ServoTimer, PeriodsKeepTheirPaceAndMissedOnesAreCounted) {
  ServoTimer timer(2e-3);
  const Clock::time_point start = Clock::now();
  double late_s = 0.0;
  constexpr int kTicks = 50;
  for (int i = 0; i < kTicks; ++i) {
    late_s = timer.wait();
    EXPECT_GE(late_s, 0.0);
  }
  const double periods = kTicks + static_cast<double>(timer.missed());
  const double elapsed_s = seconds_since(start);
  EXPECT_GE(elapsed_s, periods * 2e-3);
  // The thread woke `late_s` after the start of the last waited period. late_s includes skipped periods.
  EXPECT_LE(elapsed_s, periods * 2e-3 + std::fmod(late_s, 2e-3) + 0.5);
}

TEST(ServoTimer, AStallIsSkippedNotMadeUpInABurst) {
  ServoTimer timer(5e-3);
  timer.wait();
  const std::uint64_t before = timer.missed();
  std::this_thread::sleep_for(std::chrono::milliseconds(52));
  const double late_s = timer.wait();
  EXPECT_GE(late_s, 45e-3);
  const std::uint64_t missed = timer.missed() - before;
  EXPECT_EQ(missed, static_cast<std::uint64_t>(late_s / 5e-3));
  EXPECT_GE(missed, 9U);
  // The next ticks are again whole periods apart. Missed ticks do not follow in a burst.
  const Clock::time_point start = Clock::now();
  for (int i = 0; i < 3; ++i) timer.wait();
  EXPECT_GE(seconds_since(start), 2 * 5e-3);
}

TEST(ServoTimer, PriorityIsGrantedOrTheRemedyIsSaid) {
  std::string said;
  std::thread([&] {
    said = ServoTimer(1e-3).raise_priority();
  }).join();  // in a separate thread, so that the other tests keep their priority
  EXPECT_THAT(said, testing::AnyOf(testing::HasSubstr("SCHED_FIFO"), testing::HasSubstr("rtprio")));
  EXPECT_THAT(said, testing::HasSubstr("emory"));
  RecordProperty("said", said);
}

TEST(ServoTimer, PeriodsThatMakeNoSenseAreRefused) {
  for (const double bad : {0.0, -1.0, 1e-12, 1e9, std::numeric_limits<double>::quiet_NaN(),
                           std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW(ServoTimer timer(bad), std::invalid_argument) << bad;
  }
}

}  // namespace
