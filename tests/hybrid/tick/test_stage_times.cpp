// SPDX-License-Identifier: GPL-3.0-or-later
// The times of a tick. The times of the stages add up to the time of the tick. They do not count time in
// which the thread did not run.
#include <gtest/gtest.h>
#include <pthread.h>
#include <sched.h>

#include <atomic>
#include <chrono>
#include <numeric>
#include <string>
#include <thread>

#include "hybrid/base/thread_time.h"
#include "tests/hybrid/fixtures/touch.h"

namespace {

using hybrid::TickResult;
using tests::some_path;
using tests::Touch;
using tests::unlimited;

class StageTimes : public tests::SceneFile {};

double sum_of(const TickResult& tick) {
  return std::accumulate(tick.stage_us.begin(), tick.stage_us.end(), 0.0);
}

const std::string tissue =
    "[[soft]]\nname = \"block\"\nformula = \"block\"\nsize = [60, 60, 30]\nspacing = 1.5\n";
const std::string plate =
    "[[rigid]]\nname = \"plate\"\nprimitive = \"box\"\nsize = [60, 60, 4]\nposition = [0, 0, 30]\n";
const std::string second =
    "[[soft]]\nname = \"beside\"\nformula = \"block\"\nsize = [20, 60, 30]\nspacing = 2\nposition = [41, 0, "
    "0]\n";

TEST_F(StageTimes, AddUpToTheTickInEveryScene) {
  for (const std::string& objects : {plate, tissue, tissue + plate, tissue + second}) {
    for (const bool apart : {false, true}) {
      Touch touch(load("format = 1\n" + unlimited + objects + some_path), {0, 0, 0.05}, apart);
      double ticks_us = 0.0;
      touch.go({0, 0, 0.016}, 2e-4, 100, [&](const TickResult& tick) {
        ASSERT_NEAR(sum_of(tick), tick.tick_us, 1e-3 * tick.tick_us + 1e-9);
        ticks_us += tick.tick_us;
      });
      EXPECT_GT(ticks_us, 0.0);
    }
  }
}

// Another thread uses half of the single processor on which both may run.
TEST_F(StageTimes, DoNotCountPreemption) {
  cpu_set_t before;
  CPU_ZERO(&before);
  ASSERT_EQ(pthread_getaffinity_np(pthread_self(), sizeof before, &before), 0);
  cpu_set_t one;
  CPU_ZERO(&one);
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (!CPU_ISSET(cpu, &before)) continue;
    CPU_SET(cpu, &one);
    break;
  }
  Touch touch(load("format = 1\n" + unlimited + tissue + some_path), {0, 0, 0.05});
  if (pthread_setaffinity_np(pthread_self(), sizeof one, &one) != 0) GTEST_SKIP() << "no choice of processor";
  std::atomic<bool> stop{false};
  std::thread hog([&stop] {
    while (!stop.load(std::memory_order_relaxed)) {
    }
  });
  double stages_us = 0.0, ticks_us = 0.0, wall_us = 0.0, cpu_us = 0.0;
  const auto timed = [&](auto&& run) {
    const auto wall = std::chrono::steady_clock::now();
    const double cpu_s = hybrid::thread_time_s();
    run();
    cpu_us += 1e6 * (hybrid::thread_time_s() - cpu_s);
    wall_us += std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - wall).count();
  };
  timed([&] {
    touch.go({0, 0, 0.012}, 2e-4, 1500, [&](const TickResult& tick) {
      stages_us += sum_of(tick);
      ticks_us += tick.tick_us;
    });
  });
  stop = true;
  hog.join();
  pthread_setaffinity_np(pthread_self(), sizeof before, &before);
  if (wall_us < 1.3 * cpu_us) GTEST_SKIP() << "nothing was pre-empted";
  EXPECT_NEAR(stages_us, ticks_us, 1e-3 * ticks_us);
  EXPECT_NEAR(ticks_us, cpu_us, 0.1 * cpu_us) << "of " << wall_us << " us of wall time";
}

}  // namespace
