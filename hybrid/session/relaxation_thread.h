// SPDX-License-Identifier: GPL-3.0-or-later
// The thread that relaxes the states that the tick submits (hybrid/world/async_relaxation.h).
#pragma once

#include <atomic>
#include <memory>
#include <thread>
#include <utility>

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
  // The latest surfaces, and displacements at the points that were asked for. Only one other thread may call
  // these two: the one that draws. `points`: null for none.
  [[nodiscard]] const RelaxedTissue& tissue() noexcept { return tissue_.take(); }
  void ask(std::shared_ptr<const AskedPoints> points) {
    asked_.back() = std::move(points);
    asked_.publish();
  }

 private:
  void run();
  bool relax_submitted() noexcept;
  void publish_tissue();

  const World& world_;
  AsyncRelaxation& async_;
  double surfaces_hz_;
  TripleBuffer<RelaxedTissue> tissue_;
  TripleBuffer<std::shared_ptr<const AskedPoints>> asked_;
  std::atomic<bool> stop_{false};
  std::atomic<double> busy_s_{0.0};
  std::thread thread_;
};

}  // namespace hybrid
