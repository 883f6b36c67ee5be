// SPDX-License-Identifier: GPL-3.0-or-later
// A session that receives a signal to stop, or that crashes, ends with zero force.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdlib>
#include <new>
#include <thread>

#include "tests/device/phantom/phantom_rig.h"

namespace {

using tests::PhantomRig;

TEST(PhantomSignals, InterruptAndTerminateEndTheSessionWithZeroForce) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    const PhantomRig rig;
    device::ServoReport report;
    {
      const auto phantom = device::open_phantom(rig.options());
      std::uint64_t n = 0;
      auto push = [&](const device::ServoInput& /*input*/) {
        if (++n == 1000) raise(signal);
        return device::ServoAnswer{.force_N = {0, 0, 1}};
      };
      report = device::run_servo(*phantom, {}, push);
    }
    EXPECT_EQ(report.end, device::ServoEnd::stopped);
    EXPECT_GE(report.ticks, 1000U);
    EXPECT_EQ(rig.given_N(rig.hd->forces.size() - 1), 0.0);
    EXPECT_GT(rig.given_N(rig.hd->forces.size() - 2), 0.0);
    EXPECT_EQ(rig.hd->open_devices, 0);
    EXPECT_THAT(tests::all(report.messages), testing::HasSubstr("stopped by a signal"));
  }
}

// The last force (N) that a child process sent to the motors before it died of a crash. `crash` is called
// after 100 ticks: on another thread of the child if `from_main` is set, otherwise on the servo thread.
double last_force_of_crash(void (*crash)(), bool from_main, int& died_of) {
  void* page =
      mmap(nullptr, sizeof(std::atomic<double>), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  auto* last = new (page) std::atomic<double>(-1.0);
  const pid_t child = fork();
  if (child == 0) {
    for (const int signal : {SIGSEGV, SIGABRT, SIGFPE}) std::signal(signal, SIG_DFL);
    const PhantomRig rig;
    rig.hd->paced = true;
    rig.hd->last_force = last;
    device::PhantomOptions options = rig.options();
    options.clock_ns = nullptr;
    options.gate.ramp_s = 0.0;
    const auto phantom = device::open_phantom(options);
    std::uint64_t n = 0;
    std::atomic<bool> go{false};
    auto push = [&](const device::ServoInput& /*input*/) {
      if (++n == 100) {
        if (!from_main) crash();
        go = true;
      }
      return device::ServoAnswer{.force_N = {0, 0, 1}};
    };
    // Another thread of the session, such as the window's.
    const std::jthread other([&] {
      while (!go) usleep(500);
      if (last->load() < 0.9) _exit(3);  // no force was sent, so the test would prove nothing
      crash();
    });
    // The deadline is long, because a busy machine must not end the session.
    device::run_servo(*phantom, {.deadline_s = 60.0}, push);
    _exit(4);
  }
  int status = 0;
  waitpid(child, &status, 0);
  died_of = WIFSIGNALED(status) ? WTERMSIG(status) : -WEXITSTATUS(status);
  const double force = last->load();
  munmap(page, sizeof(std::atomic<double>));
  return force;
}

TEST(PhantomSignals, ACrashBesideTheServoThreadEndsInZeroForce) {
  int died_of = 0;
  EXPECT_EQ(last_force_of_crash([] { raise(SIGSEGV); }, true, died_of), 0.0);
  EXPECT_EQ(died_of, SIGSEGV);
  EXPECT_EQ(last_force_of_crash([] { std::abort(); }, true, died_of), 0.0);
  EXPECT_EQ(died_of, SIGABRT);
}

// The open frame ends with zero force. A real driver might not send this frame any more.
TEST(PhantomSignals, ACrashOfTheServoThreadEndsItsFrameWithZero) {
  int died_of = 0;
  EXPECT_EQ(last_force_of_crash([] { std::abort(); }, false, died_of), 0.0);
  EXPECT_EQ(died_of, SIGABRT);
}

}  // namespace
