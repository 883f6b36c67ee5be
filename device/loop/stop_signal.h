// SPDX-License-Identifier: GPL-3.0-or-later
// Signals: a session that is told to stop, or that crashes, turns the motors off first.
#pragma once

#include <cstddef>

namespace device {

// While an object exists, SIGINT, SIGTERM and SIGHUP ask the servo loop to end. A second signal of the same
// kind kills as usual. At most one object at a time.
class StopOnSignal {
 public:
  StopOnSignal();
  ~StopOnSignal();
  StopOnSignal(const StopOnSignal&) = delete;
  StopOnSignal& operator=(const StopOnSignal&) = delete;
  StopOnSignal(StopOnSignal&&) = delete;
  StopOnSignal& operator=(StopOnSignal&&) = delete;
};

// The signal that was received, or 0. Lock-free.
int stop_signal() noexcept;

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
