// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/volume/subprocess.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>

namespace {

// Only the subprocess and its caller hold the pipe's writing end. So it is closed when both have ended.
TEST(Subprocess, EndsWithItsCaller) {
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  const pid_t caller = fork();
  ASSERT_GE(caller, 0);
  if (caller == 0) {
    close(ends[0]);
    voxel::run_in_subprocess(
        [&] {
          alarm(60);
          if (write(ends[1], "x", 1) == 1) pause();
        },
        60);
    _exit(0);
  }
  close(ends[1]);
  char read_back = 0;
  EXPECT_EQ(read(ends[0], &read_back, 1), 1) << "the subprocess runs";
  kill(caller, SIGKILL);
  pollfd end{ends[0], POLLIN, 0};
  constexpr int kLongest_ms = 20'000;
  EXPECT_EQ(poll(&end, 1, kLongest_ms), 1) << "the subprocess goes on";
  EXPECT_NE(end.revents & POLLHUP, 0);
  waitpid(caller, nullptr, 0);
  close(ends[0]);
}

TEST(Subprocess, TellsHowItEnded) {
  EXPECT_EQ(voxel::run_in_subprocess([] {}, 60), 0);
  EXPECT_EQ(voxel::run_in_subprocess([] { std::raise(SIGKILL); }, 60), SIGKILL);
  EXPECT_EQ(voxel::run_in_subprocess([] { _exit(3); }, 60), SIGABRT);
}

}  // namespace
