// SPDX-License-Identifier: GPL-3.0-or-later
// The bounded queue between two threads. It keeps the order. When it is full, it refuses values and counts
// them. This is also a test for the thread sanitizer.
#include "hybrid/base/spsc_ring.h"

#include <gtest/gtest.h>

#include <thread>

namespace {

TEST(SpscRing, AFullQueueRefusesAndCounts) {
  hybrid::SpscRing<int> ring(3);
  for (int n = 0; n < 5; ++n) EXPECT_EQ(ring.push(n), n < 3);
  EXPECT_EQ(ring.refused(), 2U);
  int value = -1;
  for (int n = 0; n < 3; ++n) {
    ASSERT_TRUE(ring.pop(value));
    EXPECT_EQ(value, n);
  }
  EXPECT_FALSE(ring.pop(value));
  EXPECT_TRUE(ring.push(7));
  EXPECT_TRUE(ring.pop(value));
  EXPECT_EQ(value, 7);
}

TEST(SpscRing, ValuesArriveOnceAndInOrder) {
  constexpr std::uint64_t count = 200'000;
  hybrid::SpscRing<std::uint64_t> ring(64);
  std::jthread writer([&] {
    for (std::uint64_t n = 0; n < count;) {
      if (ring.push(n)) {
        ++n;
      } else {
        std::this_thread::yield();
      }
    }
  });
  std::uint64_t value = 0;
  for (std::uint64_t expected = 0; expected < count;) {
    if (!ring.pop(value)) {
      std::this_thread::yield();
      continue;
    }
    ASSERT_EQ(value, expected);
    ++expected;
  }
}

}  // namespace
