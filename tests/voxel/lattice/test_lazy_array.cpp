// SPDX-License-Identifier: GPL-3.0-or-later
// Arrays that take memory only where they are written: the memory that they report, and their copies.
#include "voxel/lattice/lazy_array.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <set>
#include <vector>

#include "tests/voxel/fixtures/lattice_scenes.h"
#include "tests/voxel/fixtures/process_memory.h"

namespace {

using tests::kMemoryIsOurs;
using tests::own_bytes;
using voxel::LazyArray;

constexpr std::size_t kPages = 6000;  // more than one system call asks for

std::size_t page() {
  return static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

// Writes into `count` random pages, and reads from `count` random pages. Returns the written pages.
std::set<std::size_t> write_some(LazyArray<std::uint8_t>& array, std::size_t count, std::uint32_t seed) {
  tests::Random random(seed);
  std::set<std::size_t> written;
  while (written.size() < count) {
    const auto p = static_cast<std::size_t>(random.below(static_cast<int>(kPages)));
    array[p * page() + static_cast<std::size_t>(random.below(static_cast<int>(page())))] = 1;
    written.insert(p);
  }
  unsigned sum = 0;
  for (std::size_t n = 0; n < count; ++n)
    sum += array[static_cast<std::size_t>(random.below(static_cast<int>(kPages))) * page()];
  EXPECT_LE(sum, count);
  return written;
}

TEST(LazyArray, TakesWhatWasWrittenAndNothingForWhatWasRead) {
  if (tests::reading_takes_memory()) GTEST_SKIP() << tests::kReadingTakes;
  LazyArray<std::uint8_t> array(kPages * page());
  EXPECT_EQ(array.resident_bytes(), 0U);
  const std::size_t before = own_bytes();
  for (const std::size_t count : {std::size_t{1}, std::size_t{100}, std::size_t{2500}, kPages}) {
    const std::size_t written = write_some(array, count, 3).size();
    EXPECT_EQ(array.resident_bytes(), written * page());
    if (!kMemoryIsOurs) continue;
    EXPECT_NEAR(static_cast<double>(own_bytes() - before), static_cast<double>(written * page()),
                64.0 * 1024.0);
  }
}

TEST(LazyArray, ACopyHoldsTheSameAndTakesNoMore) {
  for (const std::size_t count : {std::size_t{0}, std::size_t{700}, kPages}) {
    LazyArray<std::uint8_t> array(kPages * page() - 5);  // the last page is incomplete
    if (count > 0) {
      write_some(array, std::min(count, kPages - 1), 4);
      array[array.size() - 1] = 7;
    }
    const LazyArray<std::uint8_t> copy = array;
    EXPECT_EQ(copy.resident_bytes(), array.resident_bytes());
    EXPECT_TRUE(copy == array);
  }
}

// The system reports pages that a child process shares in the same way as pages that were only read.
TEST(LazyArray, IsCopiedWholeWhileAChildSharesIt) {
  LazyArray<std::uint8_t> array(kPages * page());
  const std::size_t written = write_some(array, 500, 5).size();
  int pipe_ends[2] = {-1, -1};
  ASSERT_EQ(pipe(pipe_ends), 0);
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    char c = 0;
    close(pipe_ends[1]);
    (void)!read(pipe_ends[0], &c, 1);  // returns when the parent closes its end
    _exit(0);
  }
  close(pipe_ends[0]);
  const LazyArray<std::uint8_t> copy = array;
  EXPECT_EQ(array.resident_bytes(), written * page());
  EXPECT_EQ(copy.resident_bytes(), written * page());
  EXPECT_TRUE(copy == array);
  close(pipe_ends[1]);
  int status = 0;
  EXPECT_EQ(waitpid(child, &status, 0), child);
}

TEST(LazyArray, AVectorTakesWhatOfItsRoomIsUsed) {
  std::vector<std::uint32_t> numbers;
  numbers.reserve(4 * kPages * page());
  EXPECT_LE(voxel::resident_bytes(numbers),
            2 * page());  // allows for other data of the memory allocator in these pages
  numbers.resize(kPages * page() / sizeof(std::uint32_t), 1U);
  EXPECT_NEAR(static_cast<double>(voxel::resident_bytes(numbers)), static_cast<double>(kPages * page()),
              static_cast<double>(2 * page()));
}

TEST(LazyArray, WhatIsGivenBackIsZeroAgain) {
  LazyArray<std::uint8_t> array(kPages * page());
  array.populate();
  std::fill(array.begin(), array.end(), std::uint8_t{1});
  // Only pages that lie completely within the range are given back.
  voxel::give_back(array.data() + 100, 10 * page());
  EXPECT_EQ(array.resident_bytes(), (kPages - 9) * page());
  EXPECT_EQ(array[page() - 1], 1);
  EXPECT_EQ(array[page()], 0);
  EXPECT_EQ(array[10 * page() - 1], 0);
  EXPECT_EQ(array[10 * page()], 1);
}

}  // namespace
