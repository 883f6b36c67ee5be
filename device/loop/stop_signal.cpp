// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/loop/stop_signal.h"

#include <signal.h>  // NOLINT(modernize-deprecated-headers): sigaction is POSIX

#include <array>
#include <atomic>
#include <cstddef>
#include <stdexcept>

namespace device {
namespace {

constexpr std::array kStops{SIGINT, SIGTERM, SIGHUP};
constexpr std::array kCrashes{SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};

std::atomic<int> stop_requested{0};
struct CrashAct {
  std::atomic<OnCrash::Act> act{nullptr};
  std::atomic<void*> user{nullptr};
};
std::array<CrashAct, OnCrash::kMost> crash_acts{};
std::size_t crash_count = 0;  // used by the thread that creates them
static_assert(std::atomic<int>::is_always_lock_free && std::atomic<void*>::is_always_lock_free);

// Previous actions; written before the handlers are installed, and read by them.
std::array<struct sigaction, kStops.size()> stops_before{};
std::array<struct sigaction, kCrashes.size()> crashes_before{};

extern "C" void hybrid_on_stop(int signal) {
  stop_requested.store(signal);
}

extern "C" void hybrid_on_crash(int signal) {
  // Each act runs once: if one crashes itself, the handler continues with those that are left.
  for (std::size_t i = crash_acts.size(); i-- > 0;) {
    if (const OnCrash::Act act = crash_acts[i].act.exchange(nullptr)) act(crash_acts[i].user.load());
  }
  for (std::size_t i = 0; i < kCrashes.size(); ++i) {
    if (kCrashes[i] == signal) sigaction(signal, &crashes_before[i], nullptr);
  }
  raise(signal);  // delivered when this handler returns, whether the signal was caused or sent
}

}  // namespace

StopOnSignal::StopOnSignal() {
  stop_requested.store(0);
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
  return stop_requested.load(std::memory_order_relaxed);
}

OnCrash::OnCrash(Act act, void* user) {
  if (crash_count == crash_acts.size()) throw std::logic_error("more acts on a crash than there is room for");
  CrashAct& mine = crash_acts[crash_count];
  mine.user.store(user);
  mine.act.store(act);
  if (crash_count++ > 0) return;
  struct sigaction action {};
  action.sa_handler = hybrid_on_crash;
  action.sa_flags = static_cast<int>(SA_NODEFER);
  sigemptyset(&action.sa_mask);
  for (std::size_t i = 0; i < kCrashes.size(); ++i) sigaction(kCrashes[i], &action, &crashes_before[i]);
}

OnCrash::~OnCrash() {
  crash_acts[--crash_count].act.store(nullptr);
  if (crash_count > 0) return;
  for (std::size_t i = 0; i < kCrashes.size(); ++i) sigaction(kCrashes[i], &crashes_before[i], nullptr);
}

}  // namespace device
