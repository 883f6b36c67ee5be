// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/stop_signal.h"

#include <signal.h>  // NOLINT(modernize-deprecated-headers): sigaction is POSIX

#include <array>
#include <atomic>
#include <cstddef>

namespace device {
namespace {

constexpr std::array kStops{SIGINT, SIGTERM, SIGHUP};
constexpr std::array kCrashes{SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};

std::atomic<int> asked{0};
std::atomic<OnCrash::Act> crash_act{nullptr};
std::atomic<void*> crash_user{nullptr};
static_assert(std::atomic<int>::is_always_lock_free && std::atomic<void*>::is_always_lock_free);

// What the signals did before; written before the handlers are installed, and read by them.
std::array<struct sigaction, kStops.size()> stops_before{};
std::array<struct sigaction, kCrashes.size()> crashes_before{};

extern "C" void hybrid_on_stop(int signal) {
  asked.store(signal);
}

extern "C" void hybrid_on_crash(int signal) {
  // Once: a crash of the act itself must not come back here.
  if (const OnCrash::Act act = crash_act.exchange(nullptr)) act(crash_user.load());
  for (std::size_t i = 0; i < kCrashes.size(); ++i) {
    if (kCrashes[i] == signal) sigaction(signal, &crashes_before[i], nullptr);
  }
  raise(signal);  // delivered when this handler returns, also where the signal was sent and not caused
}

}  // namespace

StopOnSignal::StopOnSignal() {
  asked.store(0);
  struct sigaction action {};
  action.sa_handler = hybrid_on_stop;
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigemptyset(&action.sa_mask);
  for (std::size_t i = 0; i < kStops.size(); ++i) sigaction(kStops[i], &action, &stops_before[i]);
}

StopOnSignal::~StopOnSignal() {
  for (std::size_t i = 0; i < kStops.size(); ++i) sigaction(kStops[i], &stops_before[i], nullptr);
}

int stop_signal() noexcept {
  return asked.load(std::memory_order_relaxed);
}

OnCrash::OnCrash(Act act, void* user) {
  crash_user.store(user);
  crash_act.store(act);
  struct sigaction action {};
  action.sa_handler = hybrid_on_crash;
  sigemptyset(&action.sa_mask);
  for (std::size_t i = 0; i < kCrashes.size(); ++i) sigaction(kCrashes[i], &action, &crashes_before[i]);
}

OnCrash::~OnCrash() {
  for (std::size_t i = 0; i < kCrashes.size(); ++i) sigaction(kCrashes[i], &crashes_before[i], nullptr);
  crash_act.store(nullptr);
}

}  // namespace device
