// SPDX-License-Identifier: GPL-3.0-or-later
// Signals: what runs ends early and in order when it is told to stop. A session that crashes turns the motors
// off first.
#pragma once

#include <cstddef>

namespace device {

// While an object exists, the first SIGINT, SIGTERM or SIGHUP asks for an end in order: servo loops end, and
// stop_if_asked() throws. Any further one kills as usual. A SIGHUP that was ignored stays so (nohup). Objects
// may overlap, on any thread; the first one installs the handlers, the last one restores what was there.
class StopOnSignal {
 public:
  StopOnSignal();
  ~StopOnSignal();
  StopOnSignal(const StopOnSignal&) = delete;
  StopOnSignal& operator=(const StopOnSignal&) = delete;
  StopOnSignal(StopOnSignal&&) = delete;
  StopOnSignal& operator=(StopOnSignal&&) = delete;
};

// The signal that was received while an object of StopOnSignal exists, or 0. Lock-free.
int stop_signal() noexcept;

// Thrown through long work that is told to stop. No std::exception, so that nobody takes it for an error.
struct StopAsked {
  int signal = 0;
};
// Throws StopAsked once a signal was received.
void stop_if_asked();

// While an object exists, SIGSEGV, SIGBUS, SIGFPE, SIGILL and SIGABRT call `act(user)` on the thread that
// crashed, and then take their previous effect. `act` must be safe in a signal handler. Not covered: a stack
// overflow, SIGKILL and a machine that stops. Of several objects the newest acts first; if it crashes, the
// others still act. They must be destroyed in reverse order. Throws std::logic_error for more than kMost.
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
