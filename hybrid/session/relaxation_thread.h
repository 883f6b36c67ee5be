// SPDX-License-Identifier: GPL-3.0-or-later
// The thread that relaxes the states that the tick submits (hybrid/world/async_relaxation.h).
#pragma once

#include <atomic>
#include <thread>

#include "hybrid/base/triple_buffer.h"
#include "hybrid/snapshot/snapshot.h"
#include "hybrid/world/async_relaxation.h"
#include "hybrid/world/world_state.h"

namespace hybrid {

// Gives the calling thread ordinary priority. A thread that the servo thread makes inherits its high
// priority.
void take_ordinary_priority() noexcept;

// The thread runs until this object is destroyed. It polls every 100 us, because waking it would cost the
// tick a system call.
class RelaxationThread {
 public:
  // `surfaces_hz`: how often it publishes the positions of surfaces between two results; 0: never.
  RelaxationThread(const World& world, AsyncRelaxation& async, double surfaces_hz);
  ~RelaxationThread();
  RelaxationThread(const RelaxationThread&) = delete;
  RelaxationThread& operator=(const RelaxationThread&) = delete;
  RelaxationThread(RelaxationThread&&) = delete;
  RelaxationThread& operator=(RelaxationThread&&) = delete;

  // Processor time of this thread so far (s).
  [[nodiscard]] double busy_s() const { return busy_s_.load(std::memory_order_relaxed); }
  // The latest surfaces. Only one other thread may take them: the one that draws.
  [[nodiscard]] const MovedSurfaces& surfaces() noexcept { return surfaces_.take(); }

 private:
  void run();
  bool relax_submitted() noexcept;
  void publish_surfaces();

  const World& world_;
  AsyncRelaxation& async_;
  double surfaces_hz_;
  TripleBuffer<MovedSurfaces> surfaces_;
  std::atomic<bool> stop_{false};
  std::atomic<double> busy_s_{0.0};
  std::thread thread_;
};

}  // namespace hybrid
