// SPDX-License-Identifier: GPL-3.0-or-later
// Signals. On a request to stop, running work ends early and in order. A session that crashes turns the
// motors off first.
#pragma once

#include <cstddef>

namespace device {

// While an object exists, the first SIGINT, SIGTERM or SIGHUP asks for an end in order: servo loops end, and
// stop_if_asked() throws. Any further signal kills as usual. A SIGHUP that the program was started to ignore
// (nohup) stays ignored. Several objects may exist at a time, on any thread. The first one installs the
// handlers; the last one restores the previous handlers.
class StopOnSignal {
 public:
  StopOnSignal();
  ~StopOnSignal();
  StopOnSignal(const StopOnSignal&) = delete;
  StopOnSignal& operator=(const StopOnSignal&) = delete;
  StopOnSignal(StopOnSignal&&) = delete;
  StopOnSignal& operator=(StopOnSignal&&) = delete;
};

// The signal that came while objects of StopOnSignal exist; otherwise 0. Lock-free.
int stop_signal() noexcept;

// Thrown out of long work after a signal. Not a std::exception, so that no handler takes it for an error.
struct StopAsked {
  int signal = 0;
};
// Throws StopAsked once a signal was received.
void stop_if_asked();

// While an object exists, SIGSEGV, SIGBUS, SIGFPE, SIGILL and SIGABRT call `act(user)` on the thread that
// crashed, and then have their previous effect. `act` must be safe in a signal handler. Not covered: a stack
// overflow, SIGKILL and a machine that stops. Of several objects the newest acts first; if its `act` crashes,
// the others still act. Objects must be destroyed in reverse order. Throws std::logic_error if there are more
// than kMost objects.
class OnCrash {
 public:
  static constexpr std::size_t kMost = 4;
  using Act = void (*)(void* user) noexcept;
  OnCrash(Act act, void* user);
  ~OnCrash();
  OnCrash(const OnCrash&) = delete;
  OnCrash& operator=(const OnCrash&) = delete;
  OnCrash(OnCrash&&) = delete;
  OnCrash& operator=(OnCrash&&) = delete;
};

}  // namespace device
