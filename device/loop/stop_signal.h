// SPDX-License-Identifier: GPL-3.0-or-later
// A session that is told to stop, or crashes, lets go of the motors first.
#pragma once

#include <cstddef>

namespace device {

// While one lives, SIGINT, SIGTERM and SIGHUP ask the servo loop to end; a second one of the same kind kills
// as usual. One at a time in a program.
class StopOnSignal {
 public:
  StopOnSignal();
  ~StopOnSignal();
  StopOnSignal(const StopOnSignal&) = delete;
  StopOnSignal& operator=(const StopOnSignal&) = delete;
  StopOnSignal(StopOnSignal&&) = delete;
  StopOnSignal& operator=(StopOnSignal&&) = delete;
};

// The signal that asked, 0 while there was none. Lock-free.
int stop_signal() noexcept;

// While one lives, SIGSEGV, SIGBUS, SIGFPE, SIGILL and SIGABRT call `act(user)` on the thread that crashed,
// and then do what they did before. `act` may do what a signal handler may. A stack that overflowed, SIGKILL
// and a machine that stops leave no time for it. Of several the last made acts first; if it crashes, the
// others still act. They end in the reverse order that they are made in. Throws std::logic_error: more than
// kMost.
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
