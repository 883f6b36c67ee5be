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

// The calling thread goes on at ordinary priority. A thread that the servo thread made inherits its priority.
void take_ordinary_priority() noexcept;

// Runs until it is destroyed. It polls every 100 us: waking it would be a system call from the tick.
class RelaxationThread {
 public:
  // `surfaces_hz`: how often, between two results, it also publishes where surfaces are; 0: never.
  RelaxationThread(const World& world, AsyncRelaxation& async, double surfaces_hz);
  ~RelaxationThread();
  RelaxationThread(const RelaxationThread&) = delete;
  RelaxationThread& operator=(const RelaxationThread&) = delete;
  RelaxationThread(RelaxationThread&&) = delete;
  RelaxationThread& operator=(RelaxationThread&&) = delete;

  // Its own processor time so far (s).
  [[nodiscard]] double busy_s() const { return busy_s_.load(std::memory_order_relaxed); }
  // The latest surfaces, for one other thread, which draws.
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
