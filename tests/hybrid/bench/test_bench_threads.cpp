// SPDX-License-Identifier: GPL-3.0-or-later
// Results of `hybrid bench threads`: the compared ticks do the same work, to the last bit. Times are not
// tested here.
#include "hybrid/bench/threads.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/hybrid/fixtures/touch.h"

namespace {

using hybrid::bench::ThreadsRow;

TEST(BenchThreads, WhatIsHandedOutIsFeltAsWhatWasRelaxed) {
  hybrid::bench::ThreadsBenchOptions options;
  options.scenes = {tests::source_folder / "tests/hybrid/tick/arbitration/kept.toml",
                    tests::source_folder / "tests/hybrid/tick/arbitration/soft_on_soft.toml"};
  options.seconds = 0.1;  // shorter than a path
  std::size_t said = 0;
  options.progress = [&said](const std::string& text) {  // texts such as "kept, memory: 0 of 0.1 s"
    const std::size_t of = text.rfind(" of "), from = text.rfind(": ");
    ASSERT_TRUE(of != std::string::npos && from < of) << text;
    EXPECT_LE(std::stod(text.substr(from + 2)), std::stod(text.substr(of + 4))) << text;
    ++said;
  };
  const std::vector<ThreadsRow> rows = hybrid::bench::bench_threads(options);
  ASSERT_EQ(rows.size(), 6U);
  EXPECT_EQ(said, 8U);
  for (std::size_t scene = 0; scene < rows.size(); scene += 3) {
    const ThreadsRow &relaxed = rows[scene], &handed = rows[scene + 1], &without = rows[scene + 2];
    SCOPED_TRACE(hybrid::bench::threads_table({relaxed, handed, without}));
    EXPECT_EQ(relaxed.load, "relaxation");
    EXPECT_EQ(handed.load, "memory");
    EXPECT_EQ(without.load, "nothing relaxed");
    EXPECT_GT(relaxed.results, 0U);
    EXPECT_EQ(handed.results, relaxed.results);
    EXPECT_EQ(without.results, 0U);
    EXPECT_EQ(handed.ticks, relaxed.ticks);
    EXPECT_TRUE(handed.same_ticks);
    EXPECT_FALSE(without.same_ticks);
    EXPECT_EQ(handed.p99_ratio, 1.0);
    EXPECT_GT(relaxed.p99_ratio, 0.0);
    EXPECT_EQ(hybrid::bench::to_json(handed)["same_ticks"], true);
  }
}

}  // namespace
