// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/loop/stop_signal.h"

#include <signal.h>  // NOLINT(modernize-deprecated-headers): sigaction is POSIX
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <mutex>
#include <stdexcept>
#include <string_view>

namespace device {
namespace {

constexpr std::array kStops{SIGINT, SIGTERM, SIGHUP};
constexpr std::array kCrashes{SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};

std::atomic<int> stop_requested{0};
std::mutex stops_guard;   // guards stops_installed and stops_before
int stops_installed = 0;  // objects of StopOnSignal
struct CrashAct {
  std::atomic<OnCrash::Act> act{nullptr};
  std::atomic<void*> user{nullptr};
};
std::array<CrashAct, OnCrash::kMost> crash_acts{};
std::size_t crash_count = 0;  // objects of OnCrash; used only by the thread that creates them
static_assert(std::atomic<int>::is_always_lock_free && std::atomic<void*>::is_always_lock_free);

// Previous actions: written before the handlers are installed, and read by the handlers.
std::array<struct sigaction, kStops.size()> stops_before{};
std::array<struct sigaction, kCrashes.size()> crashes_before{};

// A user may start a program so that it outlives its terminal (nohup): then SIGHUP stays ignored.
bool stays_ignored(std::size_t i) {
  return kStops[i] == SIGHUP && stops_before[i].sa_handler == SIG_IGN;
}

void restore_stops() noexcept {
  for (std::size_t i = 0; i < kStops.size(); ++i) {
    struct sigaction action = stops_before[i];
    if (action.sa_handler == SIG_IGN && !stays_ignored(i)) action.sa_handler = SIG_DFL;
    sigaction(kStops[i], &action, nullptr);
  }
}

// Handles the first signal. It restores the previous actions, so that any further signal ends the program at
// once.
extern "C" void hybrid_on_stop(int signal) {
  stop_requested.store(signal);
  restore_stops();
  if (isatty(STDERR_FILENO) != 0) {
    constexpr std::string_view kWords = "\nstopping; once more ends at once\n";
    [[maybe_unused]] const ssize_t told = write(STDERR_FILENO, kWords.data(), kWords.size());
  }
}

extern "C" void hybrid_on_crash(int signal) {
  // Each act runs once. If an act itself crashes, the handler is called again and runs the remaining acts.
  for (std::size_t i = crash_acts.size(); i-- > 0;) {
    if (const OnCrash::Act act = crash_acts[i].act.exchange(nullptr)) act(crash_acts[i].user.load());
  }
  for (std::size_t i = 0; i < kCrashes.size(); ++i) {
    if (kCrashes[i] == signal) sigaction(signal, &crashes_before[i], nullptr);
  }
  raise(signal);  // takes the previous action, both for a signal from a fault and for one that was sent
}

}  // namespace

StopOnSignal::StopOnSignal() {
  const std::lock_guard lock(stops_guard);
  if (stops_installed++ > 0) return;
  stop_requested.store(0);
  for (std::size_t i = 0; i < kStops.size(); ++i) sigaction(kStops[i], nullptr, &stops_before[i]);
  struct sigaction action {};
  action.sa_handler = hybrid_on_stop;
  sigemptyset(&action.sa_mask);
  for (const int signal : kStops) sigaddset(&action.sa_mask, signal);
  for (std::size_t i = 0; i < kStops.size(); ++i) {
    if (!stays_ignored(i)) sigaction(kStops[i], &action, nullptr);
  }
}

StopOnSignal::~StopOnSignal() {
  const std::lock_guard lock(stops_guard);
  if (--stops_installed > 0) return;
  for (std::size_t i = 0; i < kStops.size(); ++i) sigaction(kStops[i], &stops_before[i], nullptr);
  stop_requested.store(0);
}

int stop_signal() noexcept {
  return stop_requested.load(std::memory_order_relaxed);
}

void stop_if_asked() {
  if (const int signal = stop_signal(); signal != 0) throw StopAsked{signal};
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
