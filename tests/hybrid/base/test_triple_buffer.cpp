// SPDX-License-Identifier: GPL-3.0-or-later
// The triple buffer between threads: values arrive whole and in order, and the latest value is never lost.
// This is also a test for the thread sanitizer.
#include "hybrid/base/triple_buffer.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <thread>

namespace {

using Value = std::array<std::uint64_t, 64>;  // large enough that a faulty exchange would tear it

TEST(TripleBuffer, KeepsTheLatest) {
  hybrid::TripleBuffer<int> hand_over;
  EXPECT_EQ(hand_over.take(), 0);
  for (const int value : {1, 2, 3}) {
    hand_over.back() = value;
    hand_over.publish();
  }
  EXPECT_EQ(hand_over.take(), 3);
  EXPECT_EQ(hand_over.take(), 3);
}

TEST(TripleBuffer, ValuesArriveWholeAndInOrder) {
  constexpr std::uint64_t count = 200'000;
  hybrid::TripleBuffer<Value> hand_over;
  std::atomic<bool> done{false};
  std::jthread writer([&] {
    for (std::uint64_t n = 1; n <= count; ++n) {
      hand_over.back().fill(n);
      hand_over.publish();
    }
    done = true;
  });
  std::uint64_t last = 0;
  bool finished = false;
  while (last < count) {
    const Value& value = hand_over.take();
    for (const std::uint64_t x : value) ASSERT_EQ(x, value[0]);
    ASSERT_GE(value[0], last);
    last = value[0];
    // Once the writer has ended, the next read must find its last value.
    ASSERT_FALSE(finished && last < count);
    finished = done;
  }
}

}  // namespace
